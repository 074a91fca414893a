"""Geometry: meshes in object space, and the drawables that place them in the world."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.arrays import frozen
from defshade_cli.scene.closed import is_closed


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of one prim, ready to draw; compared by identity, so an unchanged mesh is not uploaded again.

    path: prim path, for messages.
    points: (V, 3) float32, object space.
    normals: (V, 3) float32, unit, object space; they agree with the winding.
    triangles: (T, 3) uint32 into points, counter-clockwise seen from outside whatever the prim's orientation.
    faces: (T,) int32, the authored face that each triangle is part of.
    display_color: (V, 3) float32, scene-linear, where it varies over the mesh; else None and the drawable has it.
    display_opacity: (V,) float32 likewise.
    double_sided: as authored. Both sides are drawn either way.
    primvars: name → (V, 1 to 4) float32, those that only layers show.
    uvs: primvar name → (V, 2) float32 texture coordinates, (0, 0) at the lower left of an image.
    level: how often a subdivision surface was refined, below 0 how often a solid was made coarser; None for others.
    """

    path: str
    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    faces: NDArray[np.int32]
    display_color: NDArray[np.float32] | None = None
    display_opacity: NDArray[np.float32] | None = None
    double_sided: bool = False
    uvs: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    primvars: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    level: int | None = None

    def __post_init__(self) -> None:
        count = len(self.points)
        freeze = object.__setattr__
        freeze(self, "points", frozen(self.points, np.float32, count, 3))
        freeze(self, "normals", frozen(self.normals, np.float32, count, 3))
        freeze(self, "triangles", frozen(self.triangles, np.uint32, len(self.triangles), 3))
        freeze(self, "faces", frozen(self.faces, np.int32, len(self.triangles)))
        if self.display_color is not None:
            freeze(self, "display_color", frozen(self.display_color, np.float32, count, 3))
        if self.display_opacity is not None:
            freeze(self, "display_opacity", frozen(self.display_opacity, np.float32, count))
        for name, width in (("primvars", -1), ("uvs", 2)):
            if named := getattr(self, name):
                freeze(self, name, {key: frozen(values, np.float32, count, width) for key, values in named.items()})

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) least and greatest corner of the drawn points, object space; NaN points do not count.

        (+inf, −inf) around nothing.
        """
        drawn = np.zeros(len(self.points), bool)
        drawn[self.triangles] = True
        axes = np.ascontiguousarray(self.points[drawn].T)
        finite = np.isfinite(axes)
        if not finite.all():
            axes = axes[:, finite.all(axis=0)]
        return np.stack([axes.min(axis=1, initial=np.inf), axes.max(axis=1, initial=-np.inf)]).astype(np.float64)

    @cached_property
    def radius(self) -> float:
        """Of a ball around the drawn points, whose middle is that of `bounds`."""
        apart = self.points[self.triangles.ravel()].astype(np.float64) - self.bounds.mean(axis=0)
        return float(np.nanmax(np.linalg.norm(apart[np.isfinite(apart).all(axis=1)], axis=1), initial=0.0))

    @cached_property
    def is_closed(self) -> bool:
        """Does what enters it leave it?"""
        return is_closed(self.points, self.triangles)


_CORNERS = np.array(list(product((0, 1), repeat=3)))
"""(8, 3) which end of a box each of its corners has along each axis."""


def box_corners(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., 8, 3) of boxes (..., 2, 3)."""
    return np.asarray(boxes[..., _CORNERS, np.arange(3)])


def world_boxes(box: NDArray[np.float64], world_from_object: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 2, 3) boxes around object-space boxes placed by matrices (N, 4, 4); NaN where one is not finite.

    box: (2, 3), or (N, 2, 3).
    """
    finite = np.isfinite(box).all(axis=(-2, -1), keepdims=True)
    corners = box_corners(np.where(finite, box, np.nan))
    linear, offset = world_from_object[:, :3, :3], world_from_object[:, None, :3, 3]
    placed = corners @ linear.transpose(0, 2, 1) + offset
    return np.stack([placed.min(axis=1), placed.max(axis=1)], axis=1)


def enclose(boxes: Iterable[NDArray[np.float64]]) -> NDArray[np.float64]:
    """(2, 3) the box around boxes (N, 2, 3), those that are not finite left out; (+inf, −inf) around nothing."""
    finite = [some[np.isfinite(some).all(axis=(1, 2))] for some in boxes]
    stacked = np.concatenate([np.empty((0, 2, 3)), *finite])
    return np.stack([stacked[:, 0].min(axis=0, initial=np.inf), stacked[:, 1].max(axis=0, initial=-np.inf)])


@dataclass(frozen=True, slots=True)
class Subset:
    """A run of a mesh's triangles with one material.

    material: index into Scene.materials.
    first, count: triangles. Subsets of a drawable do not overlap; what none covers is not drawn.
    """

    material: int
    first: int
    count: int


@dataclass(frozen=True, slots=True, eq=False)
class Drawable:
    """A mesh placed N times.

    mesh: index into Scene.meshes.
    world_from_object: (N, 4, 4) float64; mirrored and sheared matrices are allowed.
    subsets: the materials, in order of first triangle.
    paths: prim path of each instance, or one path that all share (a PointInstancer's prototype).
    instance_ids: (N,) int32, PointInstancer ids or instance order; −1 for what is not instanced.
    display_color, display_opacity: (N, 3) and (N,) float32, scene-linear; a varying colour of the mesh replaces them.
    link_sets: (N,) uint32, what scene.linking.Links count; 0 where no light leaves anything out.
    """

    mesh: int
    world_from_object: NDArray[np.float64]
    subsets: tuple[Subset, ...]
    paths: tuple[str, ...]
    instance_ids: NDArray[np.int32] = field(default_factory=lambda: np.full(1, -1, np.int32))
    display_color: NDArray[np.float32] = field(default_factory=lambda: np.full((1, 3), 0.18, np.float32))
    display_opacity: NDArray[np.float32] = field(default_factory=lambda: np.ones(1, np.float32))
    link_sets: NDArray[np.uint32] | None = None

    def __post_init__(self) -> None:
        count = len(self.world_from_object)
        if len(self.paths) not in (1, count):
            raise ValueError(f"{len(self.paths)} paths for {count} instances")
        freeze = object.__setattr__
        freeze(self, "world_from_object", frozen(self.world_from_object, np.float64, count, 4, 4))
        freeze(self, "instance_ids", frozen(self.instance_ids, np.int32, count))
        linked = self.link_sets is not None
        freeze(self, "link_sets", frozen(self.link_sets, np.uint32, count) if linked else _in_no_set(count))
        freeze(self, "display_color", frozen(self.display_color, np.float32, count, 3))
        freeze(self, "display_opacity", frozen(self.display_opacity, np.float32, count))


@lru_cache(maxsize=64)
def _in_no_set(count: int) -> NDArray[np.uint32]:
    """(count,) zeros: of a stage with few links, thousands of drawables have the same."""
    return frozen(np.zeros(count, np.uint32), np.uint32, count)
