"""Catmull–Clark masks.

Refinement: Catmull and Clark, "Recursively generated B-spline surfaces on arbitrary topological meshes", 1978.
Limit position: Halstead, Kass and DeRose, "Efficient, fair interpolation using Catmull-Clark surfaces", 1993.
Limit tangents: left eigenvectors of the refinement of the quads around a vertex, in a form without division by zero.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.subdivision.bilinear import face_points
from defshade_cli.usd.subdivision.cage import Cage
from defshade_cli.usd.subdivision.creases import crease_entries, limit_rules, refinement_rules
from defshade_cli.usd.subdivision.stencil import Entries, Masks, assemble

SMOOTH_TRIANGLE_WEIGHT = 0.47
"""Face weight at an edge of a triangle under triangleSubdivisionRule "smooth" (OpenSubdiv; .25 otherwise)."""


def refine(cage: Cage) -> Masks:
    """(V + E + F, V) masks of Cage.split_to_quads."""
    return _refine(cage, _edge_face_weights(cage, triangle_weight=0.25))


def refine_smooth_triangles(cage: Cage) -> Masks:
    """`refine` with triangleSubdivisionRule "smooth"."""
    return _refine(cage, _edge_face_weights(cage, SMOOTH_TRIANGLE_WEIGHT))


def _edge_face_weights(cage: Cage, triangle_weight: float) -> NDArray[np.float64]:
    """(E,) what each of a smooth edge's two faces weighs in its edge point."""
    by_face = np.where(cage.face_sizes == 3, triangle_weight, 0.25)
    return np.bincount(cage.edge, by_face[cage.face], cage.edge_count) / 2


def _refine(cage: Cage, edge_face_weights: NDArray[np.float64]) -> Masks:
    from_vertices, from_face_points = _vertex_points(cage)
    edges = _edge_points(cage, edge_face_weights)
    faces = np.arange(cage.face_count)
    points = cage.vertex_count + cage.edge_count
    rows = points + cage.face_count
    to_face_points = assemble((cage.face_count, cage.vertex_count), face_points(cage))
    by_faces = assemble((rows, cage.face_count), from_face_points, edges[1], (points + faces, faces, 1.0))
    return assemble((rows, cage.vertex_count), *from_vertices, edges[0]) + by_faces @ to_face_points


def _vertex_points(cage: Cage) -> tuple[list[Entries], Entries]:
    """Smooth: (n − 2)/n of the vertex, 1/n² of each neighbour and of each face point."""
    mix = refinement_rules(cage)
    n = np.maximum(cage.valence, 1)
    ring = mix.smooth / n**2
    own = mix.smooth * (n - 2) / n + mix.corner
    vertices = np.arange(cage.vertex_count)
    start, end = cage.edge_vertices.T
    return [
        (vertices, vertices, own),
        (start, end, ring[start]),
        (end, start, ring[end]),
        *crease_entries(cage, mix, centre=3 / 4, neighbour=1 / 8),
    ], (cage.origin, cage.face, ring[cage.origin])


def _edge_points(cage: Cage, face_weights: NDArray[np.float64]) -> tuple[Entries, Entries]:
    """Sharp: the midpoint. Smooth: the mean of the ends and the face points, or as the triangle rule has it."""
    sharp = np.clip(cage.edge_sharpness, 0.0, 1.0)
    end_weights = 0.5 * sharp + (1.0 - sharp) * (0.5 - face_weights)
    rows = cage.vertex_count + np.arange(cage.edge_count)
    return (
        (np.repeat(rows, 2), cage.edge_vertices.ravel(), np.repeat(end_weights, 2)),
        (cage.vertex_count + cage.edge, cage.face, ((1.0 - sharp) * face_weights)[cage.edge]),
    )


def limit(cage: Cage) -> Masks:
    """(V, V) limit positions of quads: n² : 4 : 1 over n (n + 5) where smooth, 4 : 1 : 1 over 6 on creases."""
    mix = limit_rules(cage)
    n = np.maximum(cage.valence, 1)
    ring = mix.smooth / (n * (n + 5))
    vertices = np.arange(cage.vertex_count)
    start, end = cage.edge_vertices.T
    return assemble(
        (cage.vertex_count, cage.vertex_count),
        (vertices, vertices, n**2 * ring + mix.corner),
        (start, end, 4 * ring[start]),
        (end, start, 4 * ring[end]),
        (cage.origin, cage.opposite, ring[cage.origin]),
        *crease_entries(cage, mix, centre=2 / 3, neighbour=1 / 6),
    )


def across(theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """φ (N,), the weight of the vertices across the quads in the limit tangents, against 1 of the neighbours.

    The subdominant eigenvalue of a ring whose edges stand θ apart is λ = 1/4 + h/(8φ), h = cos(θ/2), and the vertices
    across weigh (cos iθ + cos (i + 1)θ) / (16λ − 4) = φ cos (i + ½)θ.
    """
    h = np.cos(theta / 2)
    return 1.0 / (h + np.sqrt(4.0 + h**2))


def sector_weights(theta: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(inner, bounding) of the tangent that leads into a sector whose edges stand θ (N,) apart, the outer two sharp.

    The left eigenvector to λ, with h and S the cosine and sine of θ/2. Two faces give the B-spline's −1 : 4 : −1.
    """
    h, weight = np.cos(theta / 2), across(theta)
    return h * np.sin(theta / 2), -weight * (h**3 + weight * (2 * h**2 - 1))
