"""Face-varying primvars: the values form a mesh of their own, cut open where they differ across an edge.

That mesh is refined by the same masks. Along its cuts it has boundaries, so values follow B-splines there; which of its
boundary vertices are pinned is what faceVaryingLinearInterpolation says. Rules as in OpenSubdiv ("Subdivision Surfaces:
Face-varying interpolation rules").
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.subdivision.base import base_cage, smooth_edges
from defshade_cli.usd.subdivision.cage import INFINITE, Cage, Indices, find_edges
from defshade_cli.usd.subdivision.fans import walk
from defshade_cli.usd.subdivision.limit import limit_position
from defshade_cli.usd.subdivision.refinement import refine_cage
from defshade_cli.usd.subdivision.schemes import linear_scheme_of, scheme_of
from defshade_cli.usd.subdivision.stencil import Stencils, assemble
from defshade_cli.usd.subdivision.topology import Topology

LinearInterpolation = Literal["none", "cornersOnly", "cornersPlus1", "cornersPlus2", "boundaries", "all"]

_JUNCTIONS_PINNED = ("cornersPlus1", "cornersPlus2")


def refine_face_varying(
    topology: Topology,
    indices: NDArray[Any],
    value_count: int,
    rule: LinearInterpolation,
    level: int,
    at_limit: bool = False,
) -> tuple[Stencils, Indices]:
    """Stencils of a primvar's N refined values, and (H,) which of them each refined face-vertex has.

    indices: into value_count values, one for each of topology.face_indices. `level`, and the order of faces and
    face-vertices, are those of refine(). at_limit gives the values at limit()'s positions.
    Raises ValueError where indices or rule do not fit.
    """
    indices = np.asarray(indices)
    _check(topology, indices, value_count, rule)
    scheme = linear_scheme_of(topology) if rule == "all" else scheme_of(topology)
    mesh = _ValueMesh.of(base_cage(topology), indices, value_count)
    stencils, cage = refine_cage(mesh.pinned_by(rule), scheme, level)
    if at_limit:
        stencils = stencils.then(limit_position(cage, scheme))
    values = np.arange(len(mesh.source))
    authored = assemble((len(values), value_count), (values, mesh.source, 1.0))
    return Stencils((authored, *stencils.masks)), cage.origin


def _check(topology: Topology, indices: NDArray[Any], value_count: int, rule: str) -> None:
    if rule not in get_args(LinearInterpolation):
        raise ValueError(f"face-varying rule is {rule!r}, not one of {', '.join(get_args(LinearInterpolation))}")
    if len(indices) != len(topology.face_indices):
        raise ValueError(f"{len(indices)} face-varying indices for {len(topology.face_indices)} face-vertices")
    if indices.min() < 0 or indices.max() >= value_count:
        raise ValueError(f"a face-varying index is outside the {value_count} values")


@dataclass(frozen=True, eq=False, slots=True)
class _ValueMesh:
    """The control mesh with its vertices split into the N distinct values that meet there.

    cage: on the values, with the sharpness of the control mesh and infinitely sharp cuts.
    vertex: (N,) ascending, of each value.  source: (N,) index of the primvar's value.
    cut: (N,) whether an edge at the value's vertex parts values, here or at its other end.
    on_boundary: (N,) whether the value's vertex is on the boundary of the control mesh.
    """

    cage: Cage
    vertex: NDArray[np.int64]
    source: NDArray[np.int64]
    cut: NDArray[np.bool_]
    on_boundary: NDArray[np.bool_]

    @classmethod
    def of(cls, control: Cage, indices: NDArray[Any], value_count: int) -> _ValueMesh:
        keys = control.origin.astype(np.int64) * value_count + indices
        found, inverse = np.unique(keys, return_inverse=True)
        vertex, source = np.divmod(found, value_count)
        value: Indices = inverse.astype(np.int32)
        edge_vertices, edge = find_edges(control.face_offsets, value, len(found))
        control_edge = np.empty(len(edge_vertices), np.int32)
        control_edge[edge] = control.edge
        sharpness = control.edge_sharpness[control_edge], control.vertex_sharpness[vertex]
        cage = Cage(control.face_offsets, value, edge, edge_vertices, *sharpness)
        cage = replace(cage, edge_sharpness=np.where(smooth_edges(cage), sharpness[0], INFINITE))
        cuts = np.bincount(control_edge, minlength=control.edge_count) > 1
        cut, on_boundary = control.ends_of(cuts) > 0, control.ends_of(control.edge_face_count == 1) > 0
        return cls(cage, vertex, source, cut[vertex], on_boundary[vertex])

    def pinned_by(self, rule: LinearInterpolation) -> Cage:
        """The cage with the values made sharp that `rule` keeps from moving."""
        pinned = self._pinned(rule)
        sharpness = np.where(pinned, INFINITE, self.cage.vertex_sharpness)
        if rule in _JUNCTIONS_PINNED:
            sharpness = np.maximum(sharpness, self._sharpness_of_sibling() * ~pinned)
        return replace(self.cage, vertex_sharpness=sharpness)

    def _pinned(self, rule: LinearInterpolation) -> NDArray[np.bool_]:
        """(N,)"""
        siblings = np.bincount(self.vertex)[self.vertex]
        corner, pinched = self.cage.vertex_face_count == 1, self._pinched() & self.cut
        pinned = pinched | (corner & (rule != "none"))
        if rule == "boundaries":
            pinned |= self.cut | self.on_boundary
        if rule in _JUNCTIONS_PINNED:
            pinned |= self.cut & (siblings > 2)
            pinned |= (siblings == 2) & self._at_vertex_of(pinched)
        if rule == "cornersPlus2":
            pinned |= self.cut & (siblings == 1) & ~self.on_boundary
            pinned |= (siblings == 2) & self._at_vertex_of(corner)
        return pinned

    def _pinched(self) -> NDArray[np.bool_]:
        """(N,) values whose faces form several fans, or are parted by an infinitely sharp edge."""
        cage = self.cage
        fans = walk(cage, np.ones(len(cage.origin), bool))
        inner_creases = smooth_edges(cage) & (cage.edge_sharpness >= INFINITE)
        return (np.bincount(cage.origin[fans.first]) > 1) | (cage.ends_of(inner_creases) > 0)

    def _at_vertex_of(self, marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(N,) values that share their vertex with a marked one."""
        return np.isin(self.vertex, self.vertex[marked])

    def _sharpness_of_sibling(self) -> NDArray[np.float64]:
        """(N,) where two values meet and a semi-sharp crease ends at one of them, its sharpness for the other."""
        cage = self.cage
        inner = smooth_edges(cage) & (cage.edge_sharpness > 0)
        sharpness = np.zeros(cage.vertex_count)
        np.maximum.at(sharpness, cage.edge_vertices[inner], cage.edge_sharpness[inner, None])
        counts = np.bincount(self.vertex)
        first = (np.cumsum(counts) - counts)[self.vertex]
        sibling = 2 * first + 1 - np.arange(len(self.vertex))
        paired = self.cut & (counts[self.vertex] == 2) & (sharpness == 0)
        return np.where(paired, sharpness[np.where(paired, sibling, 0)], 0.0)
