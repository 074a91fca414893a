"""Normals and triangles of many small meshes at once.

Each NumPy call takes as long as some thousand numbers in it: meshes of a few faces each are laid end to end, worked on
as one, and taken apart again. What comes out is what comes out of each alone, to the bit.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from itertools import compress, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.normals import with_normals
from defshade_cli.usd.polygons import Polygons, Primvar
from defshade_cli.usd.triangulation import Triangles, triangulate

_LARGEST = 1 << 12
_CORNERS_AT_ONCE = 1 << 18
_MOST_CORNERS = 4
"""A face: the ears of larger ones are found in an order that depends on what stands beside them."""


class Corners(NamedTuple):
    """The arrays of a scene.Mesh, read-only, of polygons on which nothing lies but normals that follow from them.

    split: points are one a corner.
    """

    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    faces: NDArray[np.int32]
    split: bool


class Shaped(NamedTuple):
    """What follows from some polygons alone. normals: those of with_normals.  triangles: see triangulate.

    corners: None where something lies on the polygons.
    """

    normals: Primvar
    triangles: Triangles
    corners: Corners | None


def shape_all(meshes: Iterable[Polygons]) -> dict[Polygons, Shaped]:
    """Those of `meshes` that are small."""
    alike: dict[tuple[str, bool, bool], list[Polygons]] = defaultdict(list)
    for mesh in _small(dict.fromkeys(meshes)):
        alike[mesh.scheme, mesh.left_handed, mesh.normals is None].append(mesh)
    blocks = (block for group in alike.values() for block in _blocks(group))
    return {mesh: shaped for block in blocks for mesh, shaped in zip(block, _shape(block), strict=True)}


def _small(meshes: Iterable[Polygons]) -> Iterator[Polygons]:
    few = [mesh for mesh in meshes if 0 < len(mesh.indices) <= _LARGEST and not len(mesh.holes)]
    if few:
        counts = [mesh.counts for mesh in few]
        most = np.maximum.reduceat(np.concatenate(counts), _ends(counts)[:-1])
        yield from compress(few, most <= _MOST_CORNERS)


def _blocks(meshes: Sequence[Polygons]) -> Iterator[Sequence[Polygons]]:
    """Runs of the meshes, none of more than _CORNERS_AT_ONCE."""
    ends = np.cumsum([len(mesh.indices) for mesh in meshes])
    firsts = np.searchsorted(ends, np.arange(0, ends[-1], _CORNERS_AT_ONCE - _LARGEST), "right")
    for first, end in pairwise([*np.unique(firsts).tolist(), len(meshes)]):
        yield meshes[first:end]


def _shape(meshes: Sequence[Polygons]) -> Iterator[Shaped]:
    """meshes: of one scheme and handedness, all of them with normals or none."""
    points = _ends([mesh.points for mesh in meshes])
    faces = _ends([mesh.counts for mesh in meshes])
    corners = _ends([mesh.indices for mesh in meshes])
    whole = with_normals(_end_to_end(meshes, points[:-1]))
    cut, face = triangulate(whole, [])
    ends = np.searchsorted(face, faces)
    triangles = np.diff(ends)
    assert whole.normals is not None
    values, interpolation = whole.normals.values, whole.normals.interpolation
    split = whole.normals.splits_points
    at = faces if split else points
    first_vertices = corners if split else points
    drawn = _drawn(whole, cut, face, np.repeat(first_vertices[:-1], triangles), split=split)
    cut -= np.repeat(corners[:-1], triangles)[:, None]
    face -= np.repeat(faces[:-1], triangles).astype(np.int32)
    starts = (pairwise(bounds.tolist()) for bounds in (at, ends, first_vertices))
    for mesh, (low, high), (first, end), (top, bottom) in zip(meshes, *starts, strict=True):
        run = slice(first, end)
        mine = None
        if mesh.normals is None and not mesh.primvars:
            vertices = slice(top, bottom)
            mine = Corners(
                drawn.points[vertices], drawn.normals[vertices], drawn.triangles[run], drawn.faces[run], split
            )
        yield Shaped(mesh.normals or Primvar(values[low:high], interpolation), (cut[run], face[run]), mine)


def _drawn(
    whole: Polygons, cut: NDArray[np.intp], face: NDArray[np.int32], first: NDArray[np.intp], *, split: bool
) -> Corners:
    """The arrays of all meshes end to end, as usd/cut.py makes them of each. first: (T,) vertex of its mesh."""
    assert whole.normals is not None
    wound = cut[:, ::-1] if whole.left_handed else cut
    triangles = (wound if split else whole.indices[wound]) - first[:, None]
    arrays = (
        whole.points[whole.indices] if split else whole.points,
        whole.at_corners(whole.normals) if split else whole.normals.values,
        triangles.astype(np.uint32),
        whole.faces[face],
    )
    for array in arrays:
        array.flags.writeable = False
    return Corners(*arrays, split)


def _ends(arrays: Iterable[NDArray[Any]]) -> NDArray[np.intp]:
    """(M + 1,) where each of the arrays begins when they are laid end to end, and where the last one ends."""
    return np.cumsum([0, *map(len, arrays)])


def _end_to_end(meshes: Sequence[Polygons], first_points: NDArray[np.intp]) -> Polygons:
    """One mesh of all, without what lies on them; where they have normals, with some."""
    sizes = [len(mesh.indices) for mesh in meshes]
    counts = np.concatenate([mesh.counts for mesh in meshes])
    return Polygons(
        points=np.concatenate([mesh.points for mesh in meshes]),
        counts=counts,
        indices=np.concatenate([mesh.indices for mesh in meshes]) + np.repeat(first_points, sizes),
        faces=np.concatenate([mesh.faces for mesh in meshes]),
        scheme=meshes[0].scheme,
        left_handed=meshes[0].left_handed,
        normals=meshes[0].normals,
    )
