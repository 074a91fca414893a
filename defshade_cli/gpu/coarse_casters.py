"""Coarser triangles that stand for drawables in shadow maps, and the buffer of their indices."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.buffers import replaced
from defshade_cli.gpu.context import Gpu
from defshade_cli.scene.coarse import coarse_triangles
from defshade_cli.scene.geometry import Mesh
from defshade_cli.scene.scene import Scene

Place = tuple[int, int]
"""The first index of some triangles in the buffer, and how many indices they have; (0, 0) where all shall be drawn."""


class CoarseTriangles:
    """Those that were asked for, of one scene after another."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._buffers: list[moderngl.Buffer] = []
        self._places: dict[tuple[Mesh, int], Place] = {}

    @property
    def indices(self) -> moderngl.Buffer:
        """What places are in."""
        return self._buffers[0]

    def keep(self, meshes: Iterable[Mesh]) -> None:
        """Of these alone; others are gone from the scene."""
        kept = set(meshes)
        self._places = {key: place for key, place in self._places.items() if key[0] in kept}

    def find(self, wanted: Sequence[tuple[Mesh, int]]) -> list[Place]:
        """Of meshes at their levels, which are 2^level off in object space."""
        if not self._places.keys() >= set(wanted):
            self._upload([*dict.fromkeys([*self._places, *wanted])])
        return [self._places[key] for key in wanted]

    def _upload(self, keys: Sequence[tuple[Mesh, int]]) -> None:
        arrays = [coarse_triangles(*key) for key in keys]
        counts = [0 if array is None else array.size for array in arrays]
        ends = np.cumsum(counts).tolist()
        self._places = {key: (end - n if n else 0, n) for key, n, end in zip(keys, counts, ends, strict=True)}
        drawn = [np.empty((0, 3), np.uint32), *(array for array in arrays if array is not None)]
        self._buffers = replaced(self._gpu, self._buffers, [np.concatenate(drawn)])


@dataclass(frozen=True, slots=True, eq=False)
class CoarseCasters:
    """Drawables (D,) that coarser triangles may stand for.

    meshes: of the scene.  mesh: (D,) the number of each one's.
    scales: (D,) by which placements make lengths larger, at most; infinite where one is not finite.
    first: (D,) the first of each one's commands.  of: (C,) which of them each command draws a part of; −1 for others.
    """

    triangles: CoarseTriangles
    meshes: Sequence[Mesh]
    mesh: NDArray[np.intp]
    scales: NDArray[np.float64]
    first: NDArray[np.intp]
    of: NDArray[np.intp]

    @classmethod
    def of_scene(cls, scene: Scene, numbers: Sequence[int], triangles: CoarseTriangles) -> CoarseCasters:
        """numbers: of the drawables."""
        counts = np.array([len(drawable.subsets) for drawable in scene.drawables], np.intp)
        of = np.full(len(counts), -1, np.intp)
        of[list(numbers)] = np.arange(len(numbers))
        chosen = [scene.drawables[number] for number in numbers]
        triangles.keep(scene.meshes[drawable.mesh] for drawable in chosen)
        mesh = np.array([drawable.mesh for drawable in chosen], np.intp)
        scales = np.array([_largest_scale(drawable.world_from_object[:, :3, :3]) for drawable in chosen])
        first = (np.cumsum(counts) - counts)[list(numbers)]
        return cls(triangles, scene.meshes, mesh, scales, first, np.repeat(of, counts))

    def places(self, levels: NDArray[np.float64]) -> NDArray[np.intp]:
        """(M, D, 2) first indices and counts at levels (M, D), −∞ where all is drawn: then the count is 0."""
        places = np.zeros((*levels.shape, 2), np.intp)
        coarse = np.isfinite(levels)
        keys = np.column_stack([np.broadcast_to(self.mesh, levels.shape)[coarse], levels[coarse].astype(np.intp)])
        asked, of = np.unique(keys, axis=0, return_inverse=True)
        if len(asked):
            found = self.triangles.find([(self.meshes[mesh], level) for mesh, level in asked.tolist()])
            places[coarse] = np.array(found)[of.ravel()]
        return places

    def commands(self, table: NDArray[Any], places: NDArray[np.intp]) -> NDArray[Any]:
        """(D,) those that draw what stands in `places` (D, 2) in place of the (C,) commands of `table`."""
        commands = table[self.first]
        commands["first_index"], commands["count"] = places.T
        return commands


def _largest_scale(linear: NDArray[np.float64]) -> float:
    """Of matrices (N, 3, 3)."""
    if not np.isfinite(linear).all():
        return float("inf")
    return float(np.linalg.norm(linear, 2, axis=(1, 2)).max(initial=0.0))
