"""Authored normals carried along by a deformation that says nothing of them.

A corner's two edges and its face's normal are a frame, which the deformation takes to another: where F leads from one
to the other, normals go by F⁻ᵀ (deformation gradients: Sumner and Popović, "Deformation Transfer for Triangle Meshes",
2004). What was smooth stays smooth, and what was hard stays hard.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from defshade_cli.spaces import cross, normalize
from defshade_cli.usd.polygons.normals import faceted
from defshade_cli.usd.polygons.polygons import Polygons, Primvar

Vectors = NDArray[np.float64]


def transported(polygons: Polygons, points: NDArray[np.float32]) -> Primvar | None:
    """The polygons' normals at other points (P, 3), which they follow; None for those that belong to no point."""
    normals = polygons.normals
    if normals is None or normals.interpolation in ("constant", "uniform"):
        return None
    group, count = _groups(polygons, normals)
    before, after = _frames(polygons), _frames(replace(polygons, points=points))
    at_corners = polygons.at_corners(normals).astype(np.float64)
    a, b, m = np.einsum("fci,ci->fc", before, at_corners)[..., None]
    turned = normalize(a * cross(after[1], after[2]) + b * cross(after[2], after[0]) + m * cross(after[0], after[1]))
    turned *= (np.linalg.norm(cross(before[0], before[1]), axis=1) * _handedness(after))[:, None]
    summed = np.stack([np.bincount(group, axis, count) for axis in turned.T], axis=1)
    found = np.linalg.norm(summed, axis=1, keepdims=True)
    old = normals.values if normals.interpolation != "faceVarying" else _of_groups(at_corners, group, count)
    values = np.where(found > 0.0, summed / np.where(found > 0.0, found, 1.0), old)
    return replace(
        normals, values=(values[group] if normals.interpolation == "faceVarying" else values).astype(np.float32)
    )


def _handedness(frames: Vectors) -> NDArray[np.float64]:
    """(C,) −1 where the frame is a left one: at corners that turn inwards, and all others of left-handed polygons."""
    along, back, normal = frames
    return np.sign(np.sum(cross(along, back) * normal, axis=1))


def _groups(polygons: Polygons, normals: Primvar) -> tuple[NDArray[np.intp], int]:
    """(C,) which corners share a normal, and how many such there are: those of one point that have the same."""
    if normals.interpolation != "faceVarying":
        return polygons.indices.astype(np.intp), len(polygons.points)
    keys = np.column_stack([polygons.indices.astype(np.float64), normals.values + 0.0])
    _, group = np.unique(keys, axis=0, return_inverse=True)
    return group.ravel(), int(group.max(initial=-1)) + 1


def _of_groups(at_corners: Vectors, group: NDArray[np.intp], count: int) -> Vectors:
    values = np.empty((count, 3))
    values[group] = at_corners
    return values


def _frames(polygons: Polygons) -> Vectors:
    """(3, C, 3) at each corner the edges ahead and behind, and the face's normal."""
    preceding = np.empty_like(polygons.following)
    preceding[polygons.following] = np.arange(len(preceding))
    points = polygons.points[polygons.indices].astype(np.float64)
    normal = faceted(polygons).values[polygons.face_of_corner].astype(np.float64)
    return np.stack([points[polygons.following] - points, points[preceding] - points, normal])
