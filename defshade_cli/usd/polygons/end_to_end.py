"""Meshes laid end to end: worked on as one, and taken apart again.

Each NumPy call takes as long as some thousand numbers in it, so that small meshes are worth gathering.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.polygons.polygons import Interpolation, Polygons, Primvar, Scheme, varying
from defshade_cli.usd.values import are_finite

T = TypeVar("T")

LARGEST = 1 << 12
"""Corners of a mesh that is small."""

CORNERS_AT_ONCE = 1 << 18

_FEW = 8
"""Arrays that are looked at as fast one by one."""


class Faceted(Protocol):
    """Polygons, or what may become some."""

    @property
    def points(self) -> NDArray[np.float32]:
        """(P, 3)"""

    @property
    def counts(self) -> NDArray[np.integer]:
        """(F,) corners a face."""

    @property
    def indices(self) -> NDArray[np.integer]:
        """(C,) into points."""

    @property
    def faces(self) -> NDArray[np.int32]:
        """(F,) the authored face that each is part of."""

    @property
    def scheme(self) -> Scheme:
        """As in Polygons."""

    @property
    def left_handed(self) -> bool:
        """As in Polygons."""


class Row(NamedTuple):
    """M meshes as one. points, faces, corners: (M + 1,) where each begins, and where the last one ends."""

    polygons: Polygons
    points: NDArray[np.intp]
    faces: NDArray[np.intp]
    corners: NDArray[np.intp]

    def starts(self, interpolation: Interpolation) -> NDArray[np.intp]:
        """(M + 1,) where each mesh's values of a primvar begin, which is no constant."""
        return {"uniform": self.faces, "faceVarying": self.corners}.get(interpolation, self.points)

    def select(self, kept: NDArray[np.bool_]) -> Row:
        """The faces for which `kept` (F,) holds; the points all stay."""
        corners = kept[self.polygons.face_of_corner]
        faces_left, corners_left = (np.append(0, np.cumsum(each)) for each in (kept, corners))
        return Row(self.polygons.select(kept), self.points, faces_left[self.faces], corners_left[self.corners])


def signature(mesh: Polygons) -> Hashable:
    """Meshes for which it is the same may stand in one row; what lies on one lies on all."""
    if not mesh.primvars:
        return mesh.scheme, mesh.left_handed
    named = (mesh.normals, mesh.display_color, mesh.display_opacity)
    lying = tuple([primvar and primvar.interpolation for primvar in named])
    uvs = tuple([(name, uv.interpolation) for name, uv in mesh.uvs.items()])
    shown = tuple([(name, each.interpolation, each.values.shape[1:]) for name, each in mesh.shown.items()])
    return mesh.scheme, mesh.left_handed, lying, uvs, shown


def starts_of(arrays: Iterable[NDArray[Any]]) -> NDArray[np.intp]:
    """(M,) where each begins when they stand end to end."""
    return np.cumsum([0, *map(len, arrays)])[:-1]


def each_greatest(indices: Sequence[NDArray[np.integer]]) -> NDArray[np.uint32]:
    """(M,) of each array of int32, where what is negative counts as large. None is empty."""
    return np.maximum.reduceat(np.concatenate(indices).view(np.uint32), starts_of(indices))


def each_finite(values: Sequence[NDArray[np.float32]]) -> list[bool]:
    """Whether each array (N, ...) is finite everywhere. None is empty."""
    if len(values) <= _FEW:
        return [are_finite(each) for each in values]
    flat = [each.reshape(-1) for each in values]
    finite: list[bool] = np.logical_and.reduceat(np.isfinite(np.concatenate(flat)), starts_of(flat)).tolist()
    return finite


def blocks(items: Sequence[T], corners: Sequence[int], at_once: int = CORNERS_AT_ONCE) -> Iterator[Sequence[T]]:
    """Runs of the items, none of much more corners than `at_once` unless one item has them. corners: of each."""
    ends = np.cumsum(corners)
    firsts = np.searchsorted(ends, np.arange(0, ends[-1], at_once), "right")
    for first, end in pairwise([*dict.fromkeys(firsts.tolist()), len(items)]):
        yield items[first:end]


def lay(meshes: Sequence[Polygons]) -> Row:
    """One mesh of all, which have one signature, without their holes, and without the colours that all of one has.

    Other constants become values of points.
    """
    row = lay_bare(meshes)
    return row._replace(polygons=_dressed(row.polygons, meshes, np.diff(row.points)))


def lay_bare(meshes: Sequence[Faceted]) -> Row:
    """One mesh of all, which have their scheme and handedness in common, without what lies on them, and holes."""
    points, faces, corners = (
        np.cumsum([0, *sizes], dtype=np.intp)
        for sizes in zip(*[(len(mesh.points), len(mesh.counts), len(mesh.indices)) for mesh in meshes], strict=True)
    )
    whole = Polygons(
        points=np.concatenate([mesh.points for mesh in meshes]),
        counts=np.concatenate([mesh.counts for mesh in meshes]),
        indices=np.concatenate([mesh.indices for mesh in meshes]) + np.repeat(points[:-1], np.diff(corners)),
        faces=np.concatenate([mesh.faces for mesh in meshes]),
        scheme=meshes[0].scheme,
        left_handed=meshes[0].left_handed,
    )
    return Row(whole, points, faces, corners)


def _dressed(whole: Polygons, meshes: Sequence[Polygons], points: NDArray[np.intp]) -> Polygons:
    """points: of each mesh."""
    if not meshes[0].primvars:
        return whole
    return replace(
        whole,
        normals=_joined([mesh.normals for mesh in meshes], points),
        display_color=_joined([varying(mesh.display_color) for mesh in meshes], points),
        display_opacity=_joined([varying(mesh.display_opacity) for mesh in meshes], points),
        uvs=_all_joined([mesh.uvs for mesh in meshes], points),
        shown=_all_joined([mesh.shown for mesh in meshes], points),
    )


def _all_joined(named: Sequence[Mapping[str, Primvar]], points: NDArray[np.intp]) -> Mapping[str, Primvar]:
    laid = {name: _joined([each[name] for each in named], points) for name in named[0]}
    return {name: primvar for name, primvar in laid.items() if primvar is not None}


def _joined(primvars: Sequence[Primvar | None], points: NDArray[np.intp]) -> Primvar | None:
    values = [primvar.values for primvar in primvars if primvar is not None]
    if not values or primvars[0] is None:
        return None
    joined = np.concatenate(values)
    if primvars[0].interpolation == "constant":
        return Primvar(np.repeat(joined, points, axis=0), "vertex")
    return Primvar(joined, primvars[0].interpolation)
