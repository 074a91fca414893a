"""Faces of any size cut into triangles, all faces of a size at once.

A quad is cut along corners 0–2 unless that folds it; a larger convex face is fanned from corner 0; the others
are clipped ear by ear.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.polygons.normals import vector_areas
from defshade_cli.usd.polygons.polygons import Polygons

Triangles = tuple[NDArray[np.intp], NDArray[np.int32]]
"""Triangles as corners (T, 3), and the face of each (T,)."""

LARGEST_CLIPPED = 1 << 14
"""Corners up to which a face that is not convex is cut right: clipping may take the square of their number."""

_CUT_02 = np.array([[0, 1, 2], [0, 2, 3]])
_CUT_13 = np.array([[0, 1, 3], [1, 2, 3]])


def triangulate(polygons: Polygons, issues: list[str]) -> Triangles:
    """In the order of the faces.

    A face of n corners gives n − 2 triangles, wound as it is.
    """
    if len(polygons.counts) and polygons.counts.max() > LARGEST_CLIPPED:
        issues.append(f"faces of more than {LARGEST_CLIPPED} corners are drawn as if they were convex")
    per_face = polygons.counts - 2
    triangles = np.empty((int(per_face.sum(dtype=np.intp)), 3), np.intp)
    firsts = np.cumsum(per_face, dtype=np.intp) - per_face
    for faces, corners in polygons.by_size():
        rows = firsts[faces, None] + np.arange(corners.shape[1] - 2)
        triangles[rows] = corners[:, :1, None] + _cut(polygons.points, polygons.indices[corners])
    return triangles, np.repeat(np.arange(len(per_face), dtype=np.int32), per_face)


def _cut(points: NDArray[np.float32], indices: NDArray[Any]) -> NDArray[np.intp]:
    """Triangles (B, n − 2, 3), as corners 0…n−1, of B faces (B, n)."""
    match indices.shape[1]:
        case 3:
            return np.arange(3)[None, None]
        case 4:
            folded = _folded(points, indices)
            if not folded.any():
                return _CUT_02[None]
            return np.where(folded[:, None, None], _CUT_13, _CUT_02)
        case _:
            return _cut_large(points[indices].astype(np.float64))


def _folded(points: NDArray[np.float32], quads: NDArray[Any]) -> NDArray[np.bool_]:
    """Do the triangles beside diagonal 0–2 of quads (B, 4) face apart, more so than those beside 1–3?"""
    a, b, c, d = (np.ascontiguousarray(points.take(corner, axis=0).T, np.float64) for corner in quads.T)
    folded = _agreement(a, b, c, d) <= 0.0
    if not folded.any():
        return folded
    a, b, c, d = (corner[:, folded] for corner in (a, b, c, d))
    folded[folded] = _agreement(b, c, d, a) > _agreement(a, b, c, d)
    return folded


def _agreement(a: NDArray[Any], b: NDArray[Any], c: NDArray[Any], d: NDArray[Any]) -> NDArray[np.float64]:
    """(B,) the product of the normals of triangles abc and acd, areas included. Points are (3, B), each axis a row."""
    (x, y, z), (u, v, w), (p, q, r) = b - a, c - a, d - a
    return (y * w - z * v) * (v * r - w * q) + (z * u - x * w) * (w * p - u * r) + (x * v - y * u) * (u * q - v * p)


def _cut_large(corners: NDArray[np.float64]) -> NDArray[np.intp]:
    """Fans, and ears where a corner is not convex; a face without area has neither ears nor a wrong fan."""
    count, size = corners.shape[:2]
    fan = np.stack([np.zeros(size - 2, np.intp), np.arange(1, size - 1), np.arange(2, size)], axis=1)
    triangles = np.repeat(fan[None], count, axis=0)
    areas = vector_areas(corners)
    uv = _flattened(corners, areas)
    ahead = np.roll(uv, -1, axis=1) - uv
    behind = np.roll(ahead, 1, axis=1)
    convex = (behind[..., 0] * ahead[..., 1] > behind[..., 1] * ahead[..., 0]).all(axis=1)
    clipped = ~convex & areas.any(axis=1)
    if clipped.any() and size <= LARGEST_CLIPPED:
        from defshade_cli.usd.polygons.ears import clip_ears

        triangles[clipped] = clip_ears(uv[clipped])
    return triangles


def _flattened(corners: NDArray[np.float64], areas: NDArray[np.float64]) -> NDArray[np.float64]:
    """(B, n, 2) the faces seen along the axis nearest their normal, counter-clockwise.

    Dropping a coordinate, unlike a rotation, rounds nothing: what is collinear stays so.
    """
    rows = np.arange(len(areas))
    axis = np.abs(areas).argmax(axis=1)
    u, v = corners[rows, :, (axis + 1) % 3], corners[rows, :, (axis + 2) % 3]
    mirrored = areas[rows, axis, None] < 0.0
    return np.stack([np.where(mirrored, v, u), np.where(mirrored, u, v)], axis=-1)
