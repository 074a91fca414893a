"""The limit surface at the vertices of a refined mesh: positions and tangents, hence exact normals.

A refined mesh drawn at its limit positions lies on the surface that subdivision converges to. Semi-sharp features
that have not decayed at this level count as infinitely sharp, as in OpenSubdiv: refine at least as often as the
greatest finite sharpness to have them exact. The end vertex of an infinitely sharp crease inside the surface (a dart)
takes the smooth masks, as there, which is close but not exact. Where a sharp edge bounds five or more faces at a
vertex the schemes have no tangent plane that holds the edge (Biermann, Levin and Zorin, 2000); the normal given is
across the edge all the same.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.spaces import normalize
from defshade_cli.usd.subdivision.cage import Cage, Indices
from defshade_cli.usd.subdivision.creases import SMOOTH, vertex_rules
from defshade_cli.usd.subdivision.fans import Fans, walk
from defshade_cli.usd.subdivision.refinement import Refinement
from defshade_cli.usd.subdivision.schemes import Scheme, scheme_of
from defshade_cli.usd.subdivision.stencil import Entries, Masks, applied, assemble


@dataclass(frozen=True, eq=False, slots=True)
class Limit:
    """Masks over the V vertices of a refinement: apply them to refined points.

    position: (V, V), also for primvars with `vertex` interpolation.
    tangent1, tangent2: (S, V). Their cross product is along the normal, on the side from which faces appear
        counter-clockwise; their lengths mean nothing. One row a sector: the faces around a vertex between sharp edges,
        so that normals differ across a crease. A smooth mesh has one sector a vertex.
    vertices: (S,) ascending, the vertex of each sector.
    sectors: (H,) the sector of each face-vertex of the refinement.
    """

    position: Masks
    tangent1: Masks
    tangent2: Masks
    vertices: Indices
    sectors: Indices

    def at(self, refined: NDArray[Any]) -> NDArray[np.float64]:
        """(S, ...) where refined points (V, ...), or primvars, end."""
        return applied(self.position, refined)[self.vertices]

    def normals(self, refined_points: NDArray[Any]) -> NDArray[np.float64]:
        """(S, ..., 3) unit normals for points (V, ..., 3); zero where the surface has collapsed."""
        first, second = applied(self.tangent1, refined_points), applied(self.tangent2, refined_points)
        return normalize(np.cross(first, second))


def limit(refinement: Refinement) -> Limit:
    """Of any level; where the faces of level 0 are not regular it is read off level 1."""
    scheme, cage = scheme_of(refinement.topology), refinement.cage
    if _is_regular(cage, scheme):
        sectors = _sectors(cage, scheme)
        return Limit(scheme.limit(cage), *_tangents(cage, scheme, sectors), cage.origin[sectors.first], sectors.fan)
    return _read_off(cage, scheme)


def limit_position(cage: Cage, scheme: Scheme) -> Masks:
    """(V, V) masks of where the points of any cage end."""
    if _is_regular(cage, scheme):
        return scheme.limit(cage)
    return scheme.limit(scheme.split(cage))[: cage.vertex_count] @ scheme.refine(cage)


def _is_regular(cage: Cage, scheme: Scheme) -> bool:
    return bool((cage.face_sizes == scheme.face_size).all())


def _read_off(cage: Cage, scheme: Scheme) -> Limit:
    """The limit at the vertices of a cage of polygons, each half-edge of which becomes a quad that starts like it."""
    finer, masks = scheme.split(cage), scheme.refine(cage)
    all_sectors = _sectors(finer, scheme)
    tangents = _tangents(finer, scheme, all_sectors)
    kept, sectors = np.unique(all_sectors.fan[::4], return_inverse=True)
    return Limit(
        limit_position(cage, scheme),
        tangents[0][kept] @ masks,
        tangents[1][kept] @ masks,
        finer.origin[all_sectors.first[kept]],
        sectors.astype(np.int32),
    )


def _sectors(cage: Cage, scheme: Scheme) -> Fans:
    if scheme.faceted:
        return walk(cage, np.zeros(len(cage.origin), bool))
    sharp = cage.edge_sharpness > 0
    rules = vertex_rules(cage, cage.edge_sharpness, cage.vertex_sharpness)
    divided = (rules != SMOOTH) & (cage.ends_of(sharp) >= 2)
    return walk(cage, ~(sharp[cage.edge] & divided[cage.target]))


def _tangents(cage: Cage, scheme: Scheme, sectors: Fans) -> tuple[Masks, Masks]:
    """(S, V) each. All around a vertex: a cosine and a sine. Between sharp edges: from one to the other, and inward."""
    inner, bounding, centre = _sector_weights(scheme, sectors)
    partial = np.flatnonzero(~sectors.closed)
    start = cage.target[sectors.first[partial]]
    end = cage.origin[cage.previous[sectors.last[partial]]]
    vertex = cage.origin[sectors.first[partial]]
    shape = len(sectors.first), cage.vertex_count
    return assemble(
        shape,
        *_ring_entries(cage, scheme, sectors, np.cos, 1.0 * sectors.closed),
        (partial, start, 1.0),
        (partial, end, -1.0),
    ), assemble(
        shape,
        *_ring_entries(cage, scheme, sectors, np.sin, np.where(sectors.closed, 1.0, inner)),
        (partial, start, bounding[partial]),
        (partial, end, bounding[partial]),
        (partial, vertex, centre[partial]),
    )


def _ring_entries(
    cage: Cage, scheme: Scheme, sectors: Fans, wave: np.ufunc, scale: NDArray[Any]
) -> tuple[Entries, Entries]:
    """A wave over the neighbours of a vertex and over the vertices across its faces, times `scale` (S,)."""
    theta = (np.where(sectors.closed, 2.0, 1.0) * np.pi / sectors.size)[sectors.fan]
    weight = scale[sectors.fan]
    across = weight * scheme.across(theta)
    return (
        (sectors.fan, cage.target, weight * wave(sectors.rank * theta)),
        (sectors.fan, cage.opposite, across * wave((sectors.rank + 0.5) * theta)),
    )


def _sector_weights(scheme: Scheme, sectors: Fans) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """(S,) weights of the inner edges, the bounding ones and the centre, which makes the sum zero."""
    theta = np.pi / sectors.size
    inner, bounding = scheme.sector_weights(theta)
    sum_inner = (np.cos(theta / 2) + scheme.across(theta)) / np.sin(theta / 2)
    return inner, bounding, -2.0 * bounding - inner * sum_inner
