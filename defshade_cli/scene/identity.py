"""Which prim, instance, face and material is behind each thing that is drawn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.geometry import Drawable
from defshade_cli.scene.scene import Scene

Table = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Identities:
    """Tables over the R rows of a draw list: a subset of a drawable at one placement each, in the drawables' order,
    then the subsets', then the placements'. Number 0 is nothing, row r is number r + 1.
    """

    scene: Scene

    @cached_property
    def paths(self) -> dict[str, int]:
        """Every prim that is drawn, with its number by order of first appearance."""
        every = (path for drawable in self.scene.drawables for path in drawable.paths)
        return {path: number for number, path in enumerate(dict.fromkeys(every))}

    @cached_property
    def prim(self) -> Table:
        """(R + 1,) numbers of `paths`."""
        return _table(
            np.broadcast_to([self.paths[path] for path in drawable.paths], len(drawable.world_from_object))
            for drawable, _ in self._rows()
        )

    @cached_property
    def instance(self) -> Table:
        """(R + 1,) instance_ids."""
        return _table(drawable.instance_ids for drawable, _ in self._rows())

    @cached_property
    def material(self) -> Table:
        """(R + 1,) indices into Scene.materials."""
        return _table(
            np.full(len(drawable.world_from_object), drawable.subsets[subset].material)
            for drawable, subset in self._rows()
        )

    def of_prims(self, numbers: Mapping[str, int]) -> Table:
        """(R + 1,) a number for each row by the path of its prim; −1 for paths that have none."""
        by_prim = np.array([numbers.get(path, -1) for path in self.paths] + [-1], np.int32)
        return by_prim[self.prim]

    def faces(self, numbers: NDArray[np.uint32], triangles: NDArray[np.uint32]) -> Table:
        """The authored face behind triangles (N,), counted from the first of their row's subset."""
        return self._faces[self._first_triangle[numbers] + triangles]

    @cached_property
    def _faces(self) -> Table:
        return np.concatenate([mesh.faces for mesh in self.scene.meshes] + [np.full(1, -1, np.int32)])

    @cached_property
    def _first_triangle(self) -> NDArray[np.intp]:
        before = np.cumsum([0, *(len(mesh.faces) for mesh in self.scene.meshes)])
        firsts = (
            np.full(len(drawable.world_from_object), before[drawable.mesh] + drawable.subsets[subset].first)
            for drawable, subset in self._rows()
        )
        return np.concatenate([before[-1:], *firsts])

    def _rows(self) -> Iterator[tuple[Drawable, int]]:
        """The runs of rows: a drawable and which of its subsets."""
        for drawable in self.scene.drawables:
            for subset in range(len(drawable.subsets)):
                yield drawable, subset


def _table(runs: Iterator[NDArray[Any]]) -> Table:
    return np.concatenate([[-1], *runs]).astype(np.int32)
