"""Meshes that hold a light's reach: convex, nowhere inside the exact shape, counter-clockwise seen from outside."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

CONE_SIDES = 32
"""shaders/light_cone.vert circumscribes the circle by 1 / cos(π / 32)."""

_CONE_RINGS = 8


def sphere_volume() -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """An icosphere of 320 faces around the unit sphere: (V, 3) corners, (T, 3) indices."""
    corners, triangles = _icosahedron()
    for _ in range(2):
        corners, triangles = _subdivided(corners, triangles)
    return (corners / _inner_radius(corners, triangles)).astype(np.float32), triangles


def cone_volume() -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Apex, and a cap of rings at fractions of the cone's angle: (V, 3) as light_cone.vert reads them."""
    azimuth = 2.0 * math.pi * np.arange(CONE_SIDES) / CONE_SIDES
    circle = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    rings = [circle * (k / _CONE_RINGS) for k in range(1, _CONE_RINGS + 1)]
    disc = np.concatenate([np.zeros((1, 2)), *rings])
    triangles = _cone_triangles()
    hemisphere = _polar(disc, math.pi / 2)
    reach = 1.0 / _inner_radius(hemisphere, triangles[CONE_SIDES:] - 1)
    cap = np.column_stack([disc, np.full(len(disc), reach)])
    return np.concatenate([np.zeros((1, 3)), cap]).astype(np.float32), triangles


def _cone_triangles() -> NDArray[np.uint32]:
    """Vertex 0 is the apex, 1 the cap's pole, then the rings from the pole outwards. Sides come first."""
    i = np.arange(CONE_SIDES)
    j = (i + 1) % CONE_SIDES
    rim = 2 + (_CONE_RINGS - 1) * CONE_SIDES
    parts = [np.column_stack([0 * i, rim + j, rim + i]), np.column_stack([0 * i + 1, 2 + i, 2 + j])]
    for ring in range(_CONE_RINGS - 1):
        a, b = 2 + ring * CONE_SIDES, 2 + (ring + 1) * CONE_SIDES
        parts += [np.column_stack([a + i, b + i, b + j]), np.column_stack([a + i, b + j, a + j])]
    return np.concatenate(parts).astype(np.uint32)


def _polar(disc: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """The cap's points on the unit sphere around +Z for a cone of `angle`."""
    length = np.linalg.norm(disc, axis=1)
    azimuth = np.divide(disc, length[:, None], out=np.zeros_like(disc), where=length[:, None] > 0)
    return np.column_stack([np.sin(angle * length)[:, None] * azimuth, np.cos(angle * length)])


def _inner_radius(corners: NDArray[np.float64], triangles: NDArray[Any]) -> float:
    """Distance from the origin to the nearest face's plane."""
    a, b, c = corners[triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    return float(np.min(np.abs(np.einsum("ni,ni->n", normal, a)) / np.linalg.norm(normal, axis=1)))


def _icosahedron() -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    g = (1.0 + math.sqrt(5.0)) / 2.0
    corners = np.array(
        [[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g], [0, -1, -g], [0, 1, -g],
         [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]]
    )  # fmt: skip
    triangles = np.array(
        [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
         [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
         [8, 6, 7], [9, 8, 1]],
        np.uint32,
    )  # fmt: skip
    return corners / np.linalg.norm(corners, axis=1, keepdims=True), triangles


def _subdivided(
    corners: NDArray[np.float64], triangles: NDArray[np.uint32]
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Each face in four, new corners on the unit sphere and shared between neighbours."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middle = corners[unique].sum(axis=1)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    ab, bc, ca = (len(corners) + inverse.reshape(-1, 3)).T
    a, b, c = triangles.T
    faces = np.concatenate([np.column_stack(f) for f in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    return np.concatenate([corners, middle]), faces.astype(np.uint32)
