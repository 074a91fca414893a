"""Boxes around triangles in a complete binary tree, by which a ray finds whether anything lies in its way.

Node 1 is the root and node i has the children 2i and 2i + 1, so that a walk needs neither pointers nor a stack:
shaders/lib/rays.glsl. Every level halves its nodes' triangles along the longest side of the box of their centres.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.scene import Scene
from defshade_cli.spaces import transform_points

_LEAF = 4
"""Triangles of a leaf at most."""

_STEPS = 65530
"""Of a grid, along each axis of the root; 16 bits hold some more around them."""


@dataclass(frozen=True, slots=True, eq=False)
class TriangleTree:
    """boxes: (2L, 2, 3) float32, least and greatest corner of each node; the first is none. L leaves are the last.

    corners: (L · K, 3, 3) float32, K triangles a leaf.  centre: (3,) world space, what all of them are counted from.
    """

    boxes: NDArray[np.float32]
    corners: NDArray[np.float32]
    centre: NDArray[np.float64]

    @property
    def leaves(self) -> int:
        """How many there are."""
        return len(self.boxes) // 2

    @property
    def grid(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(3,) each: the least corner of a grid around the root, and its steps, which are small across a flat one."""
        low, high = self.boxes[1].astype(np.float64)
        step = np.maximum(high - low, 1e-6 * np.abs(self.boxes[1]).max() + 1e-30) / _STEPS
        return (low - 2.0 * step).astype(np.float32), step.astype(np.float32)

    @property
    def packed_boxes(self) -> NDArray[np.uint32]:
        """(2L, 4) on the grid, half a step or more outwards: of each axis the least in 16 bits, the greatest above."""
        low, step = (each.astype(np.float64) for each in self.grid)
        at = np.clip((self.boxes - low) / step + [[-0.5], [0.5]], 0.0, 65535.0)
        least, greatest = np.floor(at[:, 0]).astype(np.uint32), np.ceil(at[:, 1]).astype(np.uint32)
        return np.pad(least | greatest << np.uint32(16), ((0, 0), (0, 1)))

    @property
    def rounding(self) -> float:
        """What float32 may move a triangle by, and some more."""
        return 4.0 * float(np.abs(self.boxes[1]).max()) * float(np.finfo(np.float32).eps)

    @property
    def edges(self) -> NDArray[np.float32]:
        """(L · K, 3, 3): of each triangle a corner, and from there the other two."""
        first, second, third = np.moveaxis(self.corners, 1, 0)
        return np.stack([first, second - first, third - first], axis=1)

    @property
    def leaf_size(self) -> int:
        """Triangles of each."""
        return len(self.corners) // self.leaves


def triangle_tree(scene: Scene) -> TriangleTree:
    """Of all that the scene shows, every instance; triangles that are not finite are left out."""
    placed = [np.empty((0, 3, 3)), *_placed_triangles(scene)]
    corners = np.concatenate(placed)
    corners = corners[np.isfinite(corners).all(axis=(1, 2))]
    centre = 0.5 * (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) if len(corners) else np.zeros(3)
    return _tree((corners - centre).astype(np.float32), centre)


def _placed_triangles(scene: Scene) -> Iterator[NDArray[np.float64]]:
    for drawable in scene.drawables:
        mesh = scene.meshes[drawable.mesh]
        shown = np.concatenate(
            [mesh.triangles[s.first : s.first + s.count] for s in drawable.subsets] or [mesh.triangles[:0]]
        )
        for world_from_object in drawable.world_from_object:
            yield transform_points(world_from_object, mesh.points)[shown]


def _tree(corners: NDArray[np.float32], centre: NDArray[np.float64]) -> TriangleTree:
    if not len(corners):
        corners = np.zeros((1, 3, 3), np.float32)  # a point, which no ray meets
    depth = max(int(np.ceil(np.log2(len(corners) / _LEAF))), 0)
    size = -(-len(corners) // 2**depth)
    order = np.arange(size * 2**depth) * len(corners) // (size * 2**depth)  # some twice, to fill all leaves
    centres = corners.mean(axis=1)
    for level in range(depth):
        order = _halved(order.reshape(2**level, -1), centres).ravel()
    filled = corners[order]
    vertices = filled.reshape(2**depth, -1, 3)
    boxes = [np.stack([vertices.min(axis=1), vertices.max(axis=1)], axis=1)]
    while len(boxes[-1]) > 1:
        pairs = boxes[-1].reshape(-1, 2, 2, 3)
        boxes.append(np.stack([pairs[:, :, 0].min(axis=1), pairs[:, :, 1].max(axis=1)], axis=1))
    return TriangleTree(np.concatenate([np.zeros((1, 2, 3), np.float32), *boxes[::-1]]), filled, centre)


def _halved(nodes: NDArray[np.intp], centres: NDArray[np.float32]) -> NDArray[np.intp]:
    """The triangles (N, T) of nodes, those of the lower half of each first."""
    of_nodes = centres[nodes]
    longest = np.ptp(of_nodes, axis=1).argmax(axis=1)
    along = np.take_along_axis(of_nodes, longest[:, None, None], axis=2)[..., 0]
    return np.take_along_axis(nodes, np.argpartition(along, nodes.shape[1] // 2, axis=1), axis=1)
