"""Semi-sharp creases: how sharpness decays and which mask, or mix of masks, a vertex takes.

DeRose, Kass and Truong, "Subdivision Surfaces in Character Animation", 1998, with the uniform creasing of
OpenSubdiv ("Subdivision Surfaces": semi-sharp creases). A vertex is smooth with fewer than two sharp edges, a crease
with two, a corner with more or by its own sharpness. While a feature decays to nothing its mask is mixed with the
mask that follows, by the sharpness that is left.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.subdivision.cage import Cage, decayed
from defshade_cli.usd.subdivision.stencil import Entries

SMOOTH, CREASE, CORNER = range(3)


def vertex_rules(
    cage: Cage, edge_sharpness: NDArray[np.float64], vertex_sharpness: NDArray[np.float64]
) -> NDArray[np.int_]:
    """(V,) SMOOTH (darts included), CREASE or CORNER."""
    sharp_edges = cage.ends_of(edge_sharpness > 0)
    by_edges = np.select([sharp_edges < 2, sharp_edges == 2], [SMOOTH, CREASE], CORNER)
    return np.where(vertex_sharpness > 0, CORNER, by_edges)


@dataclass(frozen=True, eq=False, slots=True)
class RuleMix:
    """How much of each mask the vertices take; smooth + crease + corner is 1.

    smooth, crease, corner: (V,).
    along: (E, 2) how much of a crease each end of an edge has along that edge; sums to 2 · crease at a vertex.
    """

    smooth: NDArray[np.float64]
    crease: NDArray[np.float64]
    corner: NDArray[np.float64]
    along: NDArray[np.float64]


def limit_rules(cage: Cage) -> RuleMix:
    """The rule of each vertex as it stands: what is still semi-sharp counts as sharp."""
    rules = vertex_rules(cage, cage.edge_sharpness, cage.vertex_sharpness)
    along = (rules == CREASE)[cage.edge_vertices] * (cage.edge_sharpness > 0)[:, None]
    return RuleMix(1.0 * (rules == SMOOTH), 1.0 * (rules == CREASE), 1.0 * (rules == CORNER), 1.0 * along)


def refinement_rules(cage: Cage) -> RuleMix:
    """The rules that lead from this level to the next."""
    child_edges, child_vertices = decayed(cage.edge_sharpness), decayed(cage.vertex_sharpness)
    parent = vertex_rules(cage, cage.edge_sharpness, cage.vertex_sharpness)
    child = vertex_rules(cage, child_edges, child_vertices)
    kept = np.where(parent == child, 1.0, _sharpness_left(cage, child_vertices))

    def share(rule: int) -> NDArray[np.float64]:
        return kept * (parent == rule) + (1.0 - kept) * (child == rule)

    before, after = kept * (parent == CREASE), (1.0 - kept) * (child == CREASE)
    ends = cage.edge_vertices
    along = before[ends] * (cage.edge_sharpness > 0)[:, None] + after[ends] * (child_edges > 0)[:, None]
    return RuleMix(share(SMOOTH), share(CREASE), share(CORNER), along)


def _sharpness_left(cage: Cage, child_vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """(V,) mean sharpness, at most 1, of the features at a vertex that end with this level."""
    ending_edges = (cage.edge_sharpness > 0) & (cage.edge_sharpness <= 1)
    ends = cage.edge_vertices[ending_edges].ravel()
    of_edges = np.bincount(ends, np.repeat(cage.edge_sharpness[ending_edges], 2), cage.vertex_count)
    ending_vertices = (cage.vertex_sharpness > 0) & (child_vertices == 0)
    of_vertices = np.where(ending_vertices, cage.vertex_sharpness, 0.0)
    count = cage.ends_of(ending_edges) + ending_vertices
    return np.minimum((of_edges + of_vertices) / np.maximum(count, 1), 1.0)


def crease_entries(cage: Cage, mix: RuleMix, centre: float, neighbour: float) -> tuple[Entries, Entries]:
    """The cubic B-spline's mask along each crease, the same in every smooth scheme."""
    vertices = np.arange(cage.vertex_count)
    return (
        (vertices, vertices, centre * mix.crease),
        (cage.edge_vertices.ravel(), cage.edge_vertices[:, ::-1].ravel(), neighbour * mix.along.ravel()),
    )
