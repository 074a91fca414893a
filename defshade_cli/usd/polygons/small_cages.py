"""Small subdivision surfaces refined together.

Cages that are wired alike are columns of one product; those that are not stand end to end, their weights blocks of one
sparse matrix. What comes out is what usd/polygons/refiner.py makes of each alone, to the bit.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.polygons.control import Control
from defshade_cli.usd.polygons.end_to_end import CORNERS_AT_ONCE, LARGEST, blocks, lay_bare, signature
from defshade_cli.usd.polygons.polygons import Interpolation, Polygons, Primvar
from defshade_cli.usd.polygons.refiner import only_finite, weights_of
from defshade_cli.usd.polygons.welding import weld
from defshade_cli.usd.subdivision import Topology

_NONE = np.empty(0, np.int32)


class Cage(NamedTuple):
    """Polygons, and how they are subdivided."""

    polygons: Polygons
    control: Control


def refine_all(cages: Iterable[Cage], level: int) -> dict[Cage, Polygons]:
    """The surfaces of those that are small and nowhere collapse, and not the only ones of their kind."""
    alike: dict[Hashable, list[Cage]] = defaultdict(list)
    for cage in dict.fromkeys(cages):
        if len(cage.polygons.indices) << 2 * level <= LARGEST:
            alike[signature(cage.polygons), cage.control.rules].append(cage)
    found: dict[Cage, Polygons] = {}
    for group in (group for group in alike.values() if len(group) > 1):
        for block in blocks(group, [len(cage.polygons.indices) for cage in group], CORNERS_AT_ONCE >> 2 * level):
            for columns in _columns(block):
                found.update(_Stack(columns, level).surfaces())
    return found


def _columns(cages: Sequence[Cage]) -> Iterator[Sequence[Sequence[Cage]]]:
    """Lists of cages that are wired alike, those lists together that are as long."""
    alike: dict[Hashable, list[Cage]] = defaultdict(list)
    for cage, cut_open in zip(cages, _cut_open(cages), strict=True):
        alike[cage.control.topology, cut_open].append(cage)
    as_long: dict[int, list[list[Cage]]] = defaultdict(list)
    for wired in alike.values():
        as_long[len(wired)].append(wired)
    yield from as_long.values()


def _cut_open(cages: Sequence[Cage]) -> Sequence[Hashable]:
    """Where the values of face-varying primvars part; cages for which that is the same share their stencils."""
    primvars = enumerate(cages[0].polygons.primvars)
    lying = [_end_to_end(cages, number) for number, each in primvars if each.interpolation == "faceVarying"]
    if not lying:
        return [()] * len(cages)
    row = lay_bare([cage.polygons for cage in cages])
    sizes = np.diff(row.corners)
    welded = [weld(row.polygons.indices, values) for values in lying]
    numbers = [number - np.repeat(np.searchsorted(chosen, row.corners[:-1]), sizes) for number, chosen in welded]
    runs = pairwise(row.corners.tolist())
    return [tuple([number[first:end].tobytes() for number in numbers]) for first, end in runs]


def _end_to_end(cages: Iterable[Cage], number: int) -> NDArray[np.float32]:
    """The values of all their primvars of a number."""
    return np.concatenate([cage.polygons.primvars[number].values for cage in cages])


class _Wiring(NamedTuple):
    """Of one mesh among W: its drawn faces, and where its points, faces and corners are."""

    counts: NDArray[np.int32]
    indices: NDArray[np.int32]
    points: slice
    faces: slice
    corners: slice

    def run(self, interpolation: Interpolation) -> slice:
        """Where its values are."""
        return {"uniform": self.faces, "faceVarying": self.corners}.get(interpolation, self.points)


class _Stack:
    """W cages that are wired in as many ways, end to end; K times, each time with other points and primvars.

    columns: W lists of K.
    """

    def __init__(self, columns: Sequence[Sequence[Cage]], level: int) -> None:
        first = [column[0] for column in columns]
        self._times, self._level = len(columns[0]), level
        self._cages = [column[number] for number in range(self._times) for column in columns]
        self._row = lay_bare([cage.polygons for cage in self._cages]).polygons
        self._weights = weights_of(_of_all([cage.control for cage in first]), level)
        self._kept = ~self._weights.refinement.holes
        self._kept_corners = np.repeat(self._kept, self._weights.refinement.face_counts)
        mesh_of_face = np.repeat(np.arange(len(first)), [len(cage.polygons.counts) for cage in first])
        self._mesh_of_face = mesh_of_face[self._weights.refinement.parents]
        self._order, self._wirings = self._parts(len(first))

    def _parts(self, count: int) -> tuple[NDArray[np.intp], Sequence[_Wiring]]:
        """(S,) the points in the order of their meshes, and the meshes."""
        face_counts, sectors = self._weights.refinement.face_counts, self._weights.limit.sectors
        mesh_of_point = np.empty(len(self._weights.limit.vertices), np.intp)
        mesh_of_point[sectors] = np.repeat(self._mesh_of_face, face_counts)
        order = np.argsort(mesh_of_point, kind="stable")
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        counts, indices = face_counts[self._kept], place[sectors][self._kept_corners].astype(np.int32)
        of_face = self._mesh_of_face[self._kept]
        owners = mesh_of_point, of_face, np.repeat(of_face, counts)
        points, faces, corners = (pairwise(_starts(owner, count)) for owner in owners)
        runs = [(slice(*p), slice(*f), slice(*c)) for p, f, c in zip(points, faces, corners, strict=True)]
        return order, [_Wiring(counts[f], indices[c] - np.int32(p.start), p, f, c) for p, f, c in runs]

    def surfaces(self) -> Iterator[tuple[Cage, Polygons]]:
        """Of each cage, but for those that collapse."""
        weights, row = self._weights, self._row
        refined = weights.refinement.vertex @ self._stacked(only_finite(row.points))
        normals = weights.limit.normals(refined)[self._order] * (-1.0 if row.left_handed else 1.0)
        lost: NDArray[np.bool_] = np.logical_not(normals.any(axis=2))
        points, shading = _apart(weights.limit.at(refined)[self._order]), _apart(normals)
        faces = self._stacked(row.faces)[weights.refinement.parents][self._kept].swapaxes(0, 1)
        varying = [n for n, p in enumerate(self._cages[0].polygons.primvars) if p.interpolation != "constant"]
        lying = {number: _apart(self._carried(number)) for number in varying}
        for number, cage in enumerate(self._cages):
            turn, place = divmod(number, len(self._wirings))
            wiring = self._wirings[place]
            if lost[wiring.points, turn].any():
                continue
            own = cage.polygons
            surface = Polygons(
                points[turn, wiring.points],
                wiring.counts,
                wiring.indices,
                faces[turn, wiring.faces],
                _NONE,
                own.scheme,
                own.left_handed,
                Primvar(shading[turn, wiring.points], "vertex"),
                own.display_color,
                own.display_opacity,
                own.uvs,
                own.shown,
            )
            yield cage, _with(surface, cage, {n: values[turn] for n, values in lying.items()}, wiring)

    def _carried(self, number: int) -> NDArray[np.float64]:
        """(N, K, ...) a primvar on what is drawn."""
        values, interpolation = _end_to_end(self._cages, number), self._cages[0].polygons.primvars[number].interpolation
        if interpolation == "faceVarying":
            wired, chosen = weld(self._row.indices, values)
            first = wired[: len(wired) // self._times]
            return self._weights.carried_corners(self._stacked(values[chosen]), first)[self._kept_corners]
        carried = self._weights.carried(self._stacked(values), interpolation)
        return carried[self._kept if interpolation == "uniform" else self._order]

    def _stacked(self, values: NDArray[Any]) -> NDArray[Any]:
        """(N, K, ...) of (K · N, ...), K times as many as the weights are for."""
        return values.reshape(self._times, -1, *values.shape[1:]).swapaxes(0, 1)


def _of_all(controls: Sequence[Control]) -> Control:
    """Of cages that stand end to end."""
    if len(controls) == 1:
        return controls[0]
    return Control(Topology.end_to_end([control.topology for control in controls]), controls[0].face_varying)


def _with(surface: Polygons, cage: Cage, lying: Mapping[int, NDArray[np.float32]], wiring: _Wiring) -> Polygons:
    """With the primvars of the cage as they are on the surface. lying: by number, of W meshes."""
    if not lying:
        return surface
    own = cage.polygons.primvars
    new = {own[n]: replace(own[n], values=v[wiring.run(own[n].interpolation)]) for n, v in lying.items()}
    return surface.with_primvars(lambda primvar: new.get(primvar, primvar))


def _starts(owner: NDArray[np.intp], count: int) -> list[int]:
    """Where each of the owners begins when what they own is sorted, and where the last one ends."""
    starts: list[int] = np.cumsum([0, *np.bincount(owner, minlength=count)]).tolist()
    return starts


def _apart(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """(K, N, ...) of (N, K, ...), each of the K in one run of memory."""
    return np.ascontiguousarray(values.swapaxes(0, 1), np.float32)
