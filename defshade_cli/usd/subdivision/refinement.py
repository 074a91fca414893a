"""Uniform refinement: each level's points as stencils over the control points."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.subdivision.base import base_cage, hole_faces
from defshade_cli.usd.subdivision.cage import Cage, Indices
from defshade_cli.usd.subdivision.schemes import Scheme, linear_scheme_of, scheme_of
from defshade_cli.usd.subdivision.stencil import Stencils, identity
from defshade_cli.usd.subdivision.topology import Topology


@dataclass(frozen=True, eq=False)
class Refinement:
    """A mesh refined `level` times. Vertex i of the control mesh is vertex i of the refined one.

    vertex: V stencils of points and of primvars with `vertex` interpolation.
    parents: (F,) int32, the control face that each refined face is part of.
    holes: (F,) faces that are not part of the surface, but needed by the limit of its neighbours.
    cage: the refined faces.
    """

    topology: Topology
    level: int
    vertex: Stencils
    cage: Cage
    parents: Indices
    holes: NDArray[np.bool_]

    @property
    def face_counts(self) -> Indices:
        """(F,) vertices of each face: all 4, or 3 under Loop, from level 1 on."""
        return self.cage.face_sizes

    @property
    def face_indices(self) -> Indices:
        """(H,) vertices of the faces, wound like the control faces; a control face's children follow each other."""
        return self.cage.origin

    @cached_property
    def varying(self) -> Stencils:
        """V stencils of primvars with `varying` interpolation."""
        stencils, _ = refine_cage(base_cage(self.topology), linear_scheme_of(self.topology), self.level)
        return stencils


def refine(topology: Topology, level: int) -> Refinement:
    """`topology` refined `level` ≥ 0 times by its scheme."""
    stencils, cage = refine_cage(base_cage(topology), scheme_of(topology), level)
    parents = _parents(topology, level)
    return Refinement(topology, level, stencils, cage, parents, hole_faces(topology)[parents])


def refine_cage(cage: Cage, scheme: Scheme, level: int) -> tuple[Stencils, Cage]:
    """Stencils of the points `level` times finer, and their cage."""
    stencils = Stencils((identity(cage.vertex_count),))
    for _ in range(level):
        stencils = stencils.then(scheme.refine(cage))
        cage = scheme.split(cage)
    return stencils, cage


def _parents(topology: Topology, level: int) -> Indices:
    """Every face becomes four, but for a first split of polygons into one quad a vertex."""
    faces = np.arange(len(topology.face_counts), dtype=np.int32)
    if not level:
        return faces
    children = np.int32(4) if topology.scheme == "loop" else topology.face_counts
    return np.repeat(faces, children * 4 ** (level - 1))
