"""What is drawn of many small meshes, found at once: what comes out is what comes out of each alone, to the bit."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator, Sequence
from itertools import compress, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.polygons.end_to_end import LARGEST, Row, blocks, lay, signature
from defshade_cli.usd.polygons.normals import with_normals
from defshade_cli.usd.polygons.polygons import Polygons, Primvar
from defshade_cli.usd.polygons.triangulation import triangulate
from defshade_cli.usd.polygons.vertices import Vertices, vertices_of


class Shaped(NamedTuple):
    """polygons: which are drawn.  vertices: of these."""

    polygons: Polygons
    vertices: Vertices


def shape_all(meshes: Iterable[Polygons]) -> dict[Polygons, Shaped]:
    """Those of `meshes` that are small."""
    alike: dict[Hashable, list[Polygons]] = defaultdict(list)
    for mesh in filter(_is_small, dict.fromkeys(meshes)):
        alike[signature(mesh)].append(mesh)
    shaped: dict[Polygons, Shaped] = {}
    for group in alike.values():
        for block in blocks(group, [len(mesh.indices) for mesh in group]):
            for row_of, row in _joined(block):
                shaped.update(zip(row_of, map(Shaped, row_of, _shape(row)), strict=True))
    return shaped


def _is_small(mesh: Polygons) -> bool:
    """Not so, too, where no face may be left beside its holes."""
    return 0 < len(mesh.indices) <= LARGEST and len(mesh.holes) < len(mesh.counts)


def _joined(meshes: Sequence[Polygons]) -> Iterator[tuple[Sequence[Polygons], Row]]:
    """Meshes of one signature, by which of their face-varying primvars lie on points, where these do."""
    row = _drawn(meshes)
    lying = {primvar: _on_points(primvar, row) for primvar in row.polygons.primvars if _is_at_corners(primvar)}
    if not lying:
        yield meshes, row
        return
    kinds, kind = np.unique([agrees for _, agrees in lying.values()], axis=1, return_inverse=True)
    for number, agreeing in enumerate(kinds.T):
        chosen = meshes if len(kinds.T) == 1 else list(compress(meshes, (kind == number).tolist()))
        whole = row if len(kinds.T) == 1 else _drawn(chosen)
        yield chosen, whole._replace(polygons=_with_joined(whole, agreeing))


def _drawn(meshes: Sequence[Polygons]) -> Row:
    """With normals, and without holes, which have part in these."""
    row = lay(meshes)
    row = row._replace(polygons=with_normals(row.polygons))
    if not any(len(mesh.holes) for mesh in meshes):
        return row
    return row.select(~np.concatenate([mesh.is_hole for mesh in meshes]))


def _with_joined(row: Row, agreeing: NDArray[np.bool_]) -> Polygons:
    """agreeing: of each face-varying primvar, whether it lies on points."""
    at_corners = [primvar for primvar in row.polygons.primvars if _is_at_corners(primvar)]
    joined = dict(compress([(p, _on_points(p, row)[0]) for p in at_corners], agreeing.tolist()))
    return row.polygons.with_primvars(lambda primvar: joined.get(primvar, primvar))


def _is_at_corners(primvar: Primvar) -> bool:
    return primvar.interpolation == "faceVarying"


def _on_points(primvar: Primvar, row: Row) -> tuple[Primvar, NDArray[np.bool_]]:
    """A face-varying primvar on the points, and of each mesh, whether its corners agree; as Polygons.join."""
    indices = row.polygons.indices
    corner = np.repeat(row.corners[:-1], np.diff(row.points))
    corner[indices] = np.arange(len(indices))
    at_points = primvar.values[corner]
    agree = (at_points[indices] == primvar.values).reshape(len(indices), -1).all(axis=1)
    return Primvar(at_points, "vertex"), np.logical_and.reduceat(agree, row.corners[:-1])


def _shape(row: Row) -> Iterator[Vertices]:
    """Of each mesh of the row, which has normals."""
    whole = row.polygons
    cut, face = triangulate(whole, [])
    ends = np.searchsorted(face, row.faces)
    drawn = vertices_of(whole, (cut, face))
    firsts = row.corners if drawn.split else row.points
    own = drawn.triangles - np.repeat(firsts[:-1], np.diff(ends)).astype(np.uint32)[:, None]
    drawn = drawn._replace(triangles=own).read_only()
    for (first, end), (top, bottom) in zip(pairwise(ends.tolist()), pairwise(firsts.tolist()), strict=True):
        yield drawn.run(slice(top, bottom), slice(first, end))
