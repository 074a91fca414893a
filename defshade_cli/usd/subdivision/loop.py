"""Loop masks, for meshes of triangles.

Refinement: Loop, "Smooth Subdivision Surfaces Based on Triangles", 1987. Creases: Hoppe et al., "Piecewise smooth
surface reconstruction", 1994, with the B-spline along them as OpenSubdiv has it. Limit masks: left eigenvectors.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.subdivision.cage import Cage
from defshade_cli.usd.subdivision.creases import RuleMix, crease_entries, limit_rules, refinement_rules
from defshade_cli.usd.subdivision.stencil import Entries, Masks, assemble


def beta(valence: NDArray[Any]) -> NDArray[np.float64]:
    """Loop's weight (V,) of each neighbour: (5/8 − (3/8 + cos(2π/n)/4)²)/n."""
    return (5 / 8 - (3 / 8 + np.cos(2 * np.pi / valence) / 4) ** 2) / valence


def refine(cage: Cage) -> Masks:
    """(V + E, V) masks of Cage.split_to_triangles."""
    mix, n = refinement_rules(cage), np.maximum(cage.valence, 1)
    shape = cage.vertex_count + cage.edge_count, cage.vertex_count
    creases = crease_entries(cage, mix, centre=3 / 4, neighbour=1 / 8)
    return assemble(shape, *_ring_entries(cage, mix, beta(n)), *creases, *_edge_points(cage))


def limit(cage: Cage) -> Masks:
    """(V, V) limit positions: each neighbour 1/(n + 3/(8β)) where smooth, 4 : 1 : 1 over 6 on creases."""
    mix, n = limit_rules(cage), np.maximum(cage.valence, 1)
    neighbour = 1.0 / (n + 3 / (8 * beta(n)))
    creases = crease_entries(cage, mix, centre=2 / 3, neighbour=1 / 6)
    return assemble((cage.vertex_count,) * 2, *_ring_entries(cage, mix, neighbour), *creases)


def _ring_entries(cage: Cage, mix: RuleMix, neighbour: NDArray[Any]) -> tuple[Entries, Entries, Entries]:
    """Smooth vertices: `neighbour` (V,) of each neighbour, the rest of the vertex itself. Corners: the vertex."""
    vertices = np.arange(cage.vertex_count)
    start, end = cage.edge_vertices.T
    ring = mix.smooth * neighbour
    own = mix.smooth - cage.valence * ring + mix.corner
    return (vertices, vertices, own), (start, end, ring[start]), (end, start, ring[end])


def _edge_points(cage: Cage) -> tuple[Entries, Entries]:
    """Sharp: the midpoint. Smooth: 3/8 of each end, 1/8 of the vertices across."""
    sharp = np.clip(cage.edge_sharpness, 0.0, 1.0)
    rows = cage.vertex_count + np.arange(cage.edge_count)
    return (
        (np.repeat(rows, 2), cage.edge_vertices.ravel(), np.repeat(3 / 8 + sharp / 8, 2)),
        (cage.vertex_count + cage.edge, cage.origin[cage.previous], (1 - sharp[cage.edge]) / 8),
    )


def across(theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) zeros: Loop's tangents are the cosines and sines of the neighbours alone."""
    return np.zeros_like(theta)


def sector_weights(theta: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(inner, bounding) of the tangent that leads into a sector whose edges stand θ (N,) apart, the outer two sharp.

    The left eigenvector to λ = 3/8 + cos θ/4, which for three faces is the box spline's −1, 2, 2, −1 over −2. A sector
    of one face has no inner edge; its tangent is the eigenvector to 1/4.
    """
    cosine = np.cos(theta)
    bounding = -cosine / np.tan(theta / 2) / (2 * cosine + 1)
    return np.ones_like(theta), np.where(theta == np.pi, 1.0, bounding)
