"""Which lights each tile of the image may be lit by: their volumes against the tiles' boxes, in camera space.

A tile's box holds all that its pixels see, between its nearest and its farthest depth. Boxes are tested in two steps,
8 x 8 tiles together first. The lists may name a light too many, never one too few.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

TILE = 32
"""Pixels a side."""

_BLOCK = 8
_SLACK = 1e-4
"""Relative, for what float32 rounds in the shaders."""


def tile_grid(size: tuple[int, int]) -> tuple[int, int]:
    """(columns, rows) of the tiles of an image of (width, height)."""
    return -(-size[0] // TILE), -(-size[1] // TILE)


@dataclass(frozen=True, slots=True, eq=False)
class LightBounds:
    """Volumes of L lights in camera space.

    centre: (L, 3).  reach: (L,), infinite for a light without a place.  axis: (L, 3) unit.
    cone_angle: (L,) radians off the axis; more than π/2 for a volume that is no cone.
    """

    centre: NDArray[np.float64]
    reach: NDArray[np.float64]
    axis: NDArray[np.float64]
    cone_angle: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.reach)

    def meet(self, lights: NDArray[np.int64], boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(N,) does the volume of each of the (N,) lights meet its (N, 2, 3) box? Empty boxes meet nothing."""
        low, high, centre, reach = boxes[:, 0], boxes[:, 1], self.centre[lights], self.reach[lights]
        aside = np.maximum(np.maximum(low - centre, centre - high), 0.0)
        met = (low <= high).all(axis=1) & (np.einsum("ni,ni->n", aside, aside) <= reach**2 * (1.0 + _SLACK))
        cones = np.flatnonzero(met & (self.cone_angle[lights] <= np.pi / 2) & np.isfinite(reach))
        met[cones] = self._cones_meet(lights[cones], boxes[cones])
        return met

    def _cones_meet(self, lights: NDArray[np.int64], boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Spheres around the boxes, by their distance from the cones' mantles."""
        middle, half = boxes.mean(axis=1), 0.5 * (boxes[:, 1] - boxes[:, 0])
        offset, angle = middle - self.centre[lights], self.cone_angle[lights]
        along = np.einsum("ni,ni->n", offset, self.axis[lights])
        across = np.sqrt(np.maximum(np.einsum("ni,ni->n", offset, offset) - along**2, 0.0))
        radius = np.linalg.norm(half, axis=1) + _SLACK * (np.linalg.norm(offset, axis=1) + 1e-30)
        return np.cos(angle) * across - np.sin(angle) * along <= radius


@dataclass(frozen=True, slots=True, eq=False)
class LightLists:
    """runs: (rows, columns, 2) each tile's first entry in `lights`, and how many it has.

    lights: numbers, ascending within a run.
    """

    runs: NDArray[np.uint32]
    lights: NDArray[np.uint32]


def list_lights(bounds: LightBounds, boxes: NDArray[np.float64]) -> LightLists:
    """Of (rows, columns, 2, 3) boxes."""
    blocks, members = _blocks(boxes)
    light, block = (each.ravel() for each in np.indices((len(bounds), len(blocks))))
    near = bounds.meet(light, blocks[block])
    light, block = light[near], block[near]
    tile, light = members[block].ravel(), light.repeat(members.shape[1])
    light, tile = light[tile >= 0], tile[tile >= 0]
    near = bounds.meet(light, boxes.reshape(-1, 2, 3)[tile])
    tile, light = np.divmod(np.sort(tile[near] * len(bounds) + light[near]), max(len(bounds), 1))
    counts = np.bincount(tile, minlength=boxes[..., 0, 0].size)
    runs = np.stack([np.cumsum(counts) - counts, counts], axis=-1)
    return LightLists(runs.reshape(*boxes.shape[:2], 2).astype(np.uint32), light.astype(np.uint32))


def _blocks(boxes: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(B, 2, 3) boxes of blocks of tiles, and (B, 64) numbers of their tiles, −1 beyond the image."""
    rows, columns = boxes.shape[:2]
    down, across = -(-rows // _BLOCK), -(-columns // _BLOCK)
    numbers = np.full((down * _BLOCK, across * _BLOCK), -1)
    numbers[:rows, :columns] = np.arange(rows * columns).reshape(rows, columns)
    members = numbers.reshape(down, _BLOCK, across, _BLOCK).swapaxes(1, 2).reshape(down * across, -1)
    held = boxes.reshape(-1, 2, 3)[members]
    held[members < 0] = [[np.inf] * 3, [-np.inf] * 3]
    return np.stack([held[:, :, 0].min(axis=1), held[:, :, 1].max(axis=1)], axis=1), members


def tile_boxes(
    depths: NDArray[np.float64],
    window: NDArray[np.float64],
    size: tuple[int, int],
    *,
    perspective: bool,
) -> NDArray[np.float64]:
    """(rows, columns, 2, 3) boxes in camera space of what an image of (width, height) shows in its tiles.

    depths: (rows, columns, 2) nearest and farthest planar depth; reversed where nothing is, which gives an empty box.
    window: left, right, bottom, top on the plane one unit ahead, or in scene units without perspective.
    """
    left, right, bottom, top = window
    x, y = (
        np.minimum(np.arange(n + 1) * TILE / length, 1.0) for n, length in zip(depths.shape[1::-1], size, strict=True)
    )
    x, y = left + x * (right - left), top - y * (top - bottom)
    near, far = depths[..., 0], depths[..., 1]
    empty = near > far
    edges = [(x[None, :-1], x[None, 1:]), (y[1:, None], y[:-1, None])]
    scales = (near, far) if perspective else (np.ones_like(near),) * 2
    sides = [
        (np.minimum(low * scales[0], low * scales[1]), np.maximum(high * scales[0], high * scales[1]))
        for low, high in edges
    ]
    boxes = np.stack([np.stack([*(side[i] for side in sides), (-far, -near)[i]], axis=-1) for i in range(2)], axis=-2)
    slack = _SLACK * np.abs(boxes).max(axis=(2, 3), keepdims=True)
    boxes += slack * np.array([[-1.0], [1.0]])
    boxes[empty] = [[np.inf] * 3, [-np.inf] * 3]
    return boxes
