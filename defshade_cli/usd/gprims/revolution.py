"""Solids of revolution around Z: strips of a profile swept around the spine.

All rows of a solid share their azimuths, and strips meet in equal numbers, so that the solid is watertight.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.polygons.polygons import Polygons, Primvar

SEGMENTS = 64
"""Around a full circle; half as many from pole to pole. A silhouette is off by 1 − cos(π/64) = .12 % of its radius."""

_HALVINGS = 8
"""Rings towards an apex, each half as wide: the last facets, which share one normal, are 1/256 of the base."""


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """A smooth part of the profile, upwards.

    points: (K, 2) radius and height; a radius of exactly 0 is a pole.
    normals: (K, 2) unit, outward and upward part.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]


def arc(radius: float, height: float, start: float, stop: float, segments: int = SEGMENTS) -> Strip:
    """Of a sphere around `height` on the spine, between two elevations in radians; ±π/2 are the poles."""
    bands = max(1, math.ceil((stop - start) / (2.0 * math.pi) * segments))
    elevation = np.linspace(start, stop, bands + 1)
    normals = np.stack([np.cos(elevation), np.sin(elevation)], axis=1)
    normals[np.abs(elevation) >= math.pi / 2, 0] = 0.0
    return Strip(normals * radius + (0.0, height), normals)


def disk(radius: float, height: float, facing: float) -> Strip:
    """A cap across the spine, `facing` up (1) or down (−1)."""
    points = np.array([[radius, height], [0.0, height]])[:: int(facing)]
    return Strip(points, np.array([[0.0, facing]] * 2))


def side(bottom: float, top: float, height: float) -> Strip:
    """The mantle of a frustum from radius `bottom` at −height/2 to `top`; rings halve towards an apex."""
    wide, narrow = max(bottom, top), min(bottom, top)
    halvings = math.ceil(math.log2(wide / max(narrow, wide / 2.0**_HALVINGS))) if wide else 0
    radii = np.append(wide / 2.0 ** np.arange(max(halvings, 1)), narrow)
    towards_narrow = (wide - radii) / (wide - narrow) if wide > narrow else np.array([0.0, 1.0])
    points = np.stack([radii, height * (towards_narrow - 0.5)], axis=1)
    if bottom < top:
        points = points[::-1] * (1.0, -1.0)
    tilt = math.atan2(bottom - top, height)
    return Strip(points, np.tile([math.cos(tilt), math.sin(tilt)], (len(points), 1)))


def revolve(strips: Sequence[Strip], segments: int = SEGMENTS) -> Polygons:
    """The solid whose profile the strips make, upwards, with a normal a point."""
    points, normals, counts, indices = [], [], [], []
    first = 0
    for strip in strips:
        poles = strip.points[:, 0] == 0.0
        points.append(_sweep(strip.points, poles, segments))
        normals.append(_sweep(strip.normals, poles, segments))
        corners, kept = _bands(first, poles, segments)
        counts.append(kept.sum(axis=1))
        indices.append(corners[kept])
        first += len(points[-1])
    faces = np.concatenate(counts)
    return Polygons(
        points=np.concatenate(points),
        counts=faces,
        indices=np.concatenate(indices),
        faces=np.arange(len(faces), dtype=np.int32),
        normals=Primvar(np.concatenate(normals), "vertex"),
    )


def _sweep(profile: NDArray[np.float64], poles: NDArray[np.bool_], segments: int) -> NDArray[np.float32]:
    """(K · segments, 3) rows of a profile (K, 2). At a pole they stand in the middle of their triangle."""
    step = np.arange(segments) + 0.5 * poles[:, None]
    azimuth = step * (2.0 * math.pi / segments)
    radius, height = profile[:, :1], np.broadcast_to(profile[:, 1:], azimuth.shape)
    swept = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height], axis=-1)
    return swept.reshape(-1, 3).astype(np.float32)


def _bands(first: int, poles: NDArray[np.bool_], segments: int) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Quads (N, 4) between rows, and which of their corners count: a pole makes a triangle, two make nothing."""
    row, segment = np.mgrid[: len(poles) - 1, :segments]
    after = (segment + 1) % segments
    corners = first + np.stack(
        [
            row * segments + segment,
            row * segments + after,
            (row + 1) * segments + after,
            (row + 1) * segments + segment,
        ],
        axis=-1,
    )
    kept = np.ones(corners.shape, bool)
    kept[poles[:-1], :, 1] = False
    kept[poles[1:], :, 2] = False
    proper = ~np.repeat(poles[:-1] & poles[1:], segments)
    return corners.reshape(-1, 4)[proper], kept.reshape(-1, 4)[proper]
