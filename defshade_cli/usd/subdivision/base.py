"""The control mesh as the cage that refinement starts from: creases, corners, boundaries and holes applied.

Rules as OpenSubdiv documents them ("Subdivision Surfaces": boundary interpolation, non-manifold topology): boundary and
non-manifold edges are infinitely sharp, and so is a vertex whose faces do not form one fan.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.subdivision.cage import INFINITE, Cage, Indices, find_edges
from defshade_cli.usd.subdivision.fans import walk
from defshade_cli.usd.subdivision.topology import Topology


def base_cage(topology: Topology) -> Cage:
    """Level 0."""
    cage = _unsharp(topology)
    sharpness = np.where(smooth_edges(cage), _authored_sharpness(topology, cage.edge_vertices), INFINITE)
    return replace(cage, edge_sharpness=sharpness, vertex_sharpness=_vertex_sharpness(topology, cage))


def hole_faces(topology: Topology) -> NDArray[np.bool_]:
    """(F,) faces that are refined but not part of the surface.

    Besides the authored ones those at a boundary under interpolateBoundary "none", unless all boundary edges at the
    boundary vertex are creased infinitely sharp; the bilinear scheme has no such faces.
    """
    holes = np.zeros(len(topology.face_counts), bool)
    holes[topology.holes] = True
    if topology.interpolate_boundary == "none" and topology.scheme != "bilinear":
        cage = _unsharp(topology)
        open_edges = (cage.edge_face_count == 1) & (_authored_sharpness(topology, cage.edge_vertices) < INFINITE)
        holes[cage.face[cage.ends_of(open_edges)[cage.origin] > 0]] = True
    return holes


def smooth_edges(cage: Cage) -> NDArray[np.bool_]:
    """(E,) edges where exactly two faces of one winding meet; all others are infinitely sharp."""
    smooth = np.zeros(cage.edge_count, bool)
    smooth[cage.edge[cage.twin >= 0]] = True
    return smooth


def _unsharp(topology: Topology) -> Cage:
    face_offsets = np.concatenate([[0], np.cumsum(topology.face_counts)]).astype(np.int32)
    edge_vertices, edge = find_edges(face_offsets, topology.face_indices, topology.vertex_count)
    no_sharpness = np.zeros(len(edge_vertices)), np.zeros(topology.vertex_count)
    return Cage(face_offsets, topology.face_indices, edge, edge_vertices, *no_sharpness)


def _authored_sharpness(topology: Topology, edge_vertices: Indices) -> NDArray[np.float64]:
    """(E,) of the creases; where two name one edge the later holds."""
    sharpness = np.zeros(len(edge_vertices))
    pairs, values = topology.crease_edges()
    keys = _keys(edge_vertices, topology.vertex_count)
    wanted = _keys(np.sort(pairs, axis=1), topology.vertex_count)
    found = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    known = keys[found] == wanted
    sharpness[found[known]] = np.maximum(values[known], 0.0)
    return sharpness


def _keys(pairs: NDArray[Any], vertex_count: int) -> NDArray[np.int64]:
    return pairs[:, 0].astype(np.int64) * vertex_count + pairs[:, 1]


def _vertex_sharpness(topology: Topology, cage: Cage) -> NDArray[np.float64]:
    sharpness = np.zeros(cage.vertex_count)
    sharpness[topology.corner_indices] = np.maximum(topology.corner_sharpnesses, 0.0)
    sharpness[_torn_vertices(cage) | (cage.vertex_face_count == 0)] = INFINITE
    if topology.interpolate_boundary == "edgeAndCorner":
        sharpness[(cage.vertex_face_count == 1) & (cage.valence == 2)] = INFINITE
    return sharpness


def _torn_vertices(cage: Cage) -> NDArray[np.bool_]:
    """(V,) non-manifold vertices, but for those inside a crease along which further faces join like fins."""
    boundary = cage.edge_face_count == 1
    non_manifold = ~boundary & ~smooth_edges(cage)
    fans = walk(cage, np.ones(len(cage.origin), bool))
    fan_count = np.bincount(cage.origin[fans.first], minlength=cage.vertex_count)
    torn = (fan_count > 1) | (cage.ends_of(non_manifold) > 0)
    fins = (cage.ends_of(non_manifold) == 2) & (cage.ends_of(boundary) == 0)
    return torn & ~(fins & (cage.vertex_face_count > cage.valence))
