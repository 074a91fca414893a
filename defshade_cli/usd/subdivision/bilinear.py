"""Linear interpolation along edges and over faces: the bilinear scheme, and `varying` data of every scheme."""

from __future__ import annotations

import numpy as np

from defshade_cli.usd.subdivision.cage import Cage
from defshade_cli.usd.subdivision.stencil import Entries, Masks, assemble


def face_points(cage: Cage) -> Entries:
    """Centroids, one row a face."""
    return cage.face, cage.origin, 1.0 / cage.face_sizes[cage.face]


def _vertex_and_edge_points(cage: Cage) -> tuple[Entries, Entries]:
    vertices, edges = np.arange(cage.vertex_count), np.arange(cage.edge_count)
    return (
        (vertices, vertices, 1.0),
        (cage.vertex_count + np.repeat(edges, 2), cage.edge_vertices.ravel(), 0.5),
    )


def refine_quads(cage: Cage) -> Masks:
    """(V + E + F, V) masks of Cage.split_to_quads."""
    points = cage.vertex_count + cage.edge_count
    faces, columns, weights = face_points(cage)
    shape = points + cage.face_count, cage.vertex_count
    return assemble(shape, *_vertex_and_edge_points(cage), (points + faces, columns, weights))


def refine_triangles(cage: Cage) -> Masks:
    """(V + E, V) masks of Cage.split_to_triangles."""
    shape = cage.vertex_count + cage.edge_count, cage.vertex_count
    return assemble(shape, *_vertex_and_edge_points(cage))
