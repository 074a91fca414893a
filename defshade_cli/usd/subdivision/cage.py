"""One level of a subdivision mesh as half-edges, and the level below it.

A half-edge is a face-vertex together with the edge that leaves it along the face. Children are numbered so that
vertex i of a level is vertex i of every finer one: first the vertex points, then the edge points, then (Catmull–Clark
and bilinear) the face points.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass

Indices: TypeAlias = NDArray[np.int32]

INFINITE = 10.0
"""USD's SHARPNESS_INFINITE: from here on sharpness does not decay."""


def decayed(sharpness: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sharpness (E,) or (V,) one level finer."""
    return np.where(sharpness >= INFINITE, sharpness, np.maximum(sharpness - 1.0, 0.0))


@dataclass(frozen=True, eq=False)
class Cage:
    """Faces, edges and sharpness of one level, H half-edges in face order.

    face_offsets: (F + 1,) first half-edge of each face.
    origin: (H,) vertex that each half-edge leaves.  edge: (H,) its edge.
    edge_vertices: (E, 2).  edge_sharpness: (E,), boundary and non-manifold edges infinite.
    vertex_sharpness: (V,).
    """

    face_offsets: Indices
    origin: Indices
    edge: Indices
    edge_vertices: Indices
    edge_sharpness: NDArray[np.float64]
    vertex_sharpness: NDArray[np.float64]

    @property
    def vertex_count(self) -> int:
        """V."""
        return len(self.vertex_sharpness)

    @property
    def edge_count(self) -> int:
        """E."""
        return len(self.edge_vertices)

    @property
    def face_count(self) -> int:
        """F."""
        return len(self.face_offsets) - 1

    @cached_property
    def face_sizes(self) -> Indices:
        """(F,) corners of each face."""
        return np.diff(self.face_offsets)

    @cached_property
    def face(self) -> Indices:
        """(H,)"""
        return np.repeat(np.arange(self.face_count, dtype=np.int32), self.face_sizes)

    @cached_property
    def next(self) -> Indices:
        """(H,) the half-edge that follows along the face."""
        return next_in_face(self.face_offsets)

    @cached_property
    def previous(self) -> Indices:
        """(H,) the half-edge before along the face."""
        previous = np.arange(-1, len(self.origin) - 1, dtype=np.int32)
        previous[self.face_offsets[:-1]] = self.face_offsets[1:] - 1
        return previous

    @cached_property
    def target(self) -> Indices:
        """(H,) vertex that each half-edge goes to."""
        return self.origin[self.next]

    @property
    def opposite(self) -> Indices:
        """(H,) the vertex across the quad from each half-edge's origin."""
        return self.target[self.next]

    @cached_property
    def twin(self) -> Indices:
        """(H,) the half-edge that runs the other way along the same edge; −1 on boundary and non-manifold edges."""
        half_edges = np.arange(len(self.origin), dtype=np.int32)
        first, last = np.zeros((2, self.edge_count), np.int32)  # below an edge from a vertex to itself, one has no face
        first[self.edge[::-1]] = half_edges[::-1]
        last[self.edge] = half_edges
        opposed = (self.origin[first] != self.origin[last]) & (self.face[first] != self.face[last])
        manifold = (self.edge_face_count == 2) & opposed
        return np.where(manifold[self.edge], first[self.edge] + last[self.edge] - half_edges, np.int32(-1))

    @cached_property
    def edge_face_count(self) -> NDArray[np.intp]:
        """(E,)"""
        return np.bincount(self.edge, minlength=self.edge_count)

    @cached_property
    def vertex_face_count(self) -> NDArray[np.intp]:
        """(V,) face-vertices at each vertex."""
        return np.bincount(self.origin, minlength=self.vertex_count)

    @cached_property
    def valence(self) -> NDArray[np.intp]:
        """(V,) edges at each vertex."""
        return np.bincount(self.edge_vertices.ravel(), minlength=self.vertex_count)

    def ends_of(self, edges: NDArray[np.bool_]) -> NDArray[np.intp]:
        """(V,) how many of the marked (E,) edges meet at each vertex."""
        return np.bincount(self.edge_vertices[edges].ravel(), minlength=self.vertex_count)

    @cached_property
    def _halves(self) -> tuple[Indices, Indices]:
        """Children of the edges that leave and reach each half-edge's origin, on the origin's side; (H,) each."""
        arriving = self.edge[self.previous]
        return (
            2 * self.edge + (self.origin != self.edge_vertices[self.edge, 0]),
            2 * arriving + (self.origin != self.edge_vertices[arriving, 0]),
        )

    def _child(self, origin: NDArray[Any], edge: NDArray[Any], inner_edges: NDArray[Any], added_vertices: int) -> Cage:
        """The next level, of faces that all have origin.shape[1] vertices."""
        middle = self.vertex_count + np.arange(self.edge_count)
        halves = np.stack([self.edge_vertices[:, 0], middle, middle, self.edge_vertices[:, 1]], axis=1)
        edge_sharpness = np.repeat(decayed(self.edge_sharpness), 2)
        return Cage(
            face_offsets=np.arange(0, origin.size + 1, origin.shape[1], dtype=np.int32),
            origin=origin.astype(np.int32).ravel(),
            edge=edge.astype(np.int32).ravel(),
            edge_vertices=np.concatenate([halves.reshape(-1, 2), inner_edges]).astype(np.int32),
            edge_sharpness=np.concatenate([edge_sharpness, np.zeros(len(inner_edges))]),
            vertex_sharpness=np.concatenate([decayed(self.vertex_sharpness), np.zeros(added_vertices)]),
        )

    def split_to_quads(self) -> Cage:
        """One quad for each half-edge: its origin, its edge point, its face point, the edge point before."""
        edge_point = self.vertex_count + self.edge
        face_point = self.vertex_count + self.edge_count + self.face
        spoke = 2 * self.edge_count + np.arange(len(self.origin))
        leaving, arriving = self._halves
        return self._child(
            np.stack([self.origin, edge_point, face_point, edge_point[self.previous]], axis=1),
            np.stack([leaving, spoke, spoke[self.previous], arriving], axis=1),
            np.stack([edge_point, face_point], axis=1),
            self.edge_count + self.face_count,
        )

    def split_to_triangles(self) -> Cage:
        """Four triangles for each: one at each vertex, and one of the edge points. All faces are triangles."""
        edge_point = self.vertex_count + self.edge
        cut = 2 * self.edge_count + np.arange(len(self.origin))
        leaving, arriving = self._halves
        corner_origin = np.stack([self.origin, edge_point, edge_point[self.previous]], axis=1).reshape(-1, 3, 3)
        corner_edge = np.stack([leaving, cut, arriving], axis=1).reshape(-1, 3, 3)
        centre_origin, centre_edge = edge_point.reshape(-1, 1, 3), cut[self.next].reshape(-1, 1, 3)
        return self._child(
            np.concatenate([corner_origin, centre_origin], axis=1).reshape(-1, 3),
            np.concatenate([corner_edge, centre_edge], axis=1).reshape(-1, 3),
            np.stack([edge_point, edge_point[self.previous]], axis=1),
            self.edge_count,
        )


def next_in_face(face_offsets: Indices) -> Indices:
    """(corners,) the corner that follows each around its face; face_offsets: (F + 1,)."""
    following = np.arange(1, face_offsets[-1] + 1, dtype=np.int32)
    following[face_offsets[1:] - 1] = face_offsets[:-1]
    return following


def find_edges(face_offsets: Indices, origin: Indices, vertex_count: int) -> tuple[Indices, Indices]:
    """(E, 2) vertices of the distinct edges, in ascending order, and (H,) the edge of each half-edge."""
    pairs = np.stack([origin, origin[next_in_face(face_offsets)]])
    keys = pairs.min(axis=0).astype(np.int64) * vertex_count + pairs.max(axis=0)
    found, edge = np.unique(keys, return_inverse=True)
    return np.stack(np.divmod(found, vertex_count), axis=1).astype(np.int32), edge.astype(np.int32)
