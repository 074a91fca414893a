"""The solids of revolution as Hydra draws them: Catmull-Clark cages of ten segments, refined as often as meshes are.

A tessellation finer than that is not what usdrecord shows at any complexity: refined, the cages shrink to within the
solids that they stand for, a sphere by 8 % of its radius at the equator. Hydra: GeomUtil's mesh generators and
HdsiImplicitSurfaceSceneIndex.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.polygons.polygons import Polygons

SEGMENTS = 10
_CAP_BANDS = 4
"""From the rim of a capsule's end to its pole."""

Profile = Sequence[tuple[float, float]]
"""Radius and height of ring after ring, upwards."""


def sphere_cage(radius: float) -> Polygons:
    """The cage of a UsdGeomSphere, as OpenUSD's UsdImaging builds it. radius: in scene units."""
    rings = [_on_sphere(radius, 0.0, math.pi * (k / SEGMENTS - 0.5)) for k in range(1, SEGMENTS)]
    return _swept([rings], bottom=-radius, top=radius)


def frustum_cage(height: float, top: float, bottom: float) -> Polygons:
    """Caps share no points with the mantle: their rims are creases."""
    low, high = (bottom, -0.5 * height), (top, 0.5 * height)
    return _swept([[low], [low, high], [high]], bottom=low[1], top=high[1])


def cone_cage(height: float, radius: float) -> Polygons:
    """The apex is a ring without width."""
    low = (radius, -0.5 * height)
    return _swept([[low], [low, (0.0, 0.5 * height)]], bottom=low[1])


def capsule_cage(height: float, top: float, bottom: float) -> Polygons:
    """Of radii that differ the mantle is tangent to the spheres, which are centred `height` apart."""
    meet = math.asin(max(-1.0, min((bottom - top) / height, 1.0))) if height else 0.0
    elevations = (
        np.linspace(-math.pi / 2, meet, _CAP_BANDS + 1)[1:],
        np.linspace(meet, math.pi / 2, _CAP_BANDS + 1)[:-1],
    )
    ends = ((bottom, -0.5 * height), (top, 0.5 * height))
    rings = [_on_sphere(r, h, e) for (r, h), band in zip(ends, elevations, strict=True) for e in band]
    return _swept([rings], bottom=-0.5 * height - bottom, top=0.5 * height + top)


def _on_sphere(radius: float, height: float, elevation: float) -> tuple[float, float]:
    return radius * math.cos(elevation), height + radius * math.sin(elevation)


def _swept(strips: Sequence[Profile], bottom: float, top: float | None = None) -> Polygons:
    """Strips of quads between rings, with a fan of triangles below the first ring and, for a `top`, above the last."""
    rings = np.array([ring for strip in strips for ring in strip])
    poles = [(0.0, 0.0, height) for height in (bottom, top) if height is not None]
    points = np.concatenate([_circles(rings), poles])
    pole = len(rings) * SEGMENTS
    ends = np.cumsum([len(strip) for strip in strips])
    lower = np.setdiff1d(np.arange(len(rings)), ends - 1)
    fans = [_fan(0, pole)[:, ::-1]] + [_fan(pole - SEGMENTS, pole + 1)] * (top is not None)
    quads = np.concatenate([_band(ring * SEGMENTS) for ring in lower]) if len(lower) else np.empty((0, 4), int)
    counts = np.repeat([4, 3], [len(quads), sum(map(len, fans))])
    return Polygons(
        points=points.astype(np.float32),
        counts=counts,
        indices=np.concatenate([quads.ravel(), *(fan.ravel() for fan in fans)]),
        faces=np.arange(len(counts), dtype=np.int32),
        scheme="catmullClark",
    )


def _circles(rings: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K · SEGMENTS, 3)"""
    azimuth = np.arange(SEGMENTS) * (2.0 * math.pi / SEGMENTS)
    x, y = rings[:, :1] * np.cos(azimuth), rings[:, :1] * np.sin(azimuth)
    return np.stack([x, y, np.broadcast_to(rings[:, 1:], x.shape)], axis=-1).reshape(-1, 3)


def _band(first: int) -> NDArray[np.intp]:
    """(SEGMENTS, 4) quads from the ring that starts with `first` to the next."""
    here = np.arange(SEGMENTS)
    after = (here + 1) % SEGMENTS
    return first + np.stack([here, after, after + SEGMENTS, here + SEGMENTS], axis=1)


def _fan(first: int, pole: int) -> NDArray[np.intp]:
    """(SEGMENTS, 3) triangles from a ring up to a pole."""
    here = np.arange(SEGMENTS)
    return np.stack([first + here, first + (here + 1) % SEGMENTS, np.full(SEGMENTS, pole)], axis=1)
