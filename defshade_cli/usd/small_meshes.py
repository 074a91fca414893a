"""Normals and triangles of many small meshes at once.

Each NumPy call takes as long as some thousand numbers in it: meshes of a few faces each are laid end to end, worked on
as one, and taken apart again. What comes out is what comes out of each alone, to the bit.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.normals import with_normals
from defshade_cli.usd.polygons import Polygons, Primvar
from defshade_cli.usd.triangulation import Triangles, triangulate

_LARGEST = 1 << 12
_CORNERS_AT_ONCE = 1 << 18
_MOST_CORNERS = 4
"""A face: the ears of larger ones are found in an order that depends on what stands beside them."""


class Shaped(NamedTuple):
    """What follows from some polygons alone. normals: those of with_normals.  triangles: see triangulate."""

    normals: Primvar
    triangles: Triangles


def shape_all(meshes: Iterable[Polygons]) -> dict[Polygons, Shaped]:
    """Those of `meshes` that are small."""
    alike: dict[tuple[str, bool, bool], list[Polygons]] = defaultdict(list)
    for mesh in dict.fromkeys(meshes):
        if _is_small(mesh):
            alike[mesh.scheme, mesh.left_handed, mesh.normals is None].append(mesh)
    blocks = (block for group in alike.values() for block in _blocks(group))
    return {mesh: shaped for block in blocks for mesh, shaped in zip(block, _shape(block), strict=True)}


def _is_small(mesh: Polygons) -> bool:
    return 0 < len(mesh.indices) <= _LARGEST and not len(mesh.holes) and int(mesh.counts.max()) <= _MOST_CORNERS


def _blocks(meshes: Sequence[Polygons]) -> Iterator[Sequence[Polygons]]:
    """Runs of the meshes, none of more than _CORNERS_AT_ONCE."""
    ends = np.cumsum([len(mesh.indices) for mesh in meshes])
    firsts = np.searchsorted(ends, np.arange(0, ends[-1], _CORNERS_AT_ONCE - _LARGEST), "right")
    for first, end in pairwise([*np.unique(firsts).tolist(), len(meshes)]):
        yield meshes[first:end]


def _shape(meshes: Sequence[Polygons]) -> Iterator[Shaped]:
    """meshes: of one scheme and handedness, all of them with normals or none."""
    points, faces, corners = _ends(meshes, "points"), _ends(meshes, "counts"), _ends(meshes, "indices")
    whole = with_normals(_end_to_end(meshes, points[:-1]))
    cut, face = triangulate(whole, [])
    ends = np.searchsorted(face, faces)
    cut -= np.repeat(corners[:-1], np.diff(ends))[:, None]
    face -= np.repeat(faces[:-1], np.diff(ends)).astype(np.int32)
    assert whole.normals is not None
    values, interpolation = whole.normals.values, whole.normals.interpolation
    at = faces if interpolation == "uniform" else points
    runs = zip(meshes, pairwise(at.tolist()), pairwise(ends.tolist()), strict=True)
    for mesh, (low, high), (first, end) in runs:
        normals = mesh.normals or Primvar(values[low:high], interpolation)
        yield Shaped(normals, (cut[first:end], face[first:end]))


def _ends(meshes: Sequence[Polygons], name: str) -> NDArray[np.intp]:
    """(M + 1,) where the elements of each mesh begin, and where the last ones end."""
    return np.cumsum([0, *(len(getattr(mesh, name)) for mesh in meshes)])


def _end_to_end(meshes: Sequence[Polygons], first_points: NDArray[np.intp]) -> Polygons:
    """One mesh of all, without what lies on them; where they have normals, with some."""
    sizes = [len(mesh.indices) for mesh in meshes]
    counts = np.concatenate([mesh.counts for mesh in meshes])
    return Polygons(
        points=np.concatenate([mesh.points for mesh in meshes]),
        counts=counts,
        indices=np.concatenate([mesh.indices for mesh in meshes]) + np.repeat(first_points, sizes),
        faces=np.arange(len(counts), dtype=np.int32),
        scheme=meshes[0].scheme,
        left_handed=meshes[0].left_handed,
        normals=meshes[0].normals,
    )
