"""How many points stand for each light in one sample.

Few samples show lights as few points: hard shadows in place of soft ones. So a frame has `light_points` points of a
large light at least, however few its samples are; where several are large they share them, and a light that looks small
needs but one. Numbers are powers of two, at which the points' pattern is a net.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.light import DomeLight, Light
from defshade_cli.settings import RenderSettings

_SMALL, _MIDDLING = 0.03, 0.12
"""Radius over distance: up to the first one point does, up to the second a quarter of the largest lights' number."""


_RAYS_FOR_EACH_POINT = 0.25
"""Of a large light, in all samples together; at least."""

_SKY_DIRECTIONS, _FOR_EACH_POINT = 4, 8
"""Of a dome: in a sample, and in all samples together for each point of a large light; at least."""


def points_of(light: Light, shared: int, settings: RenderSettings) -> int:
    """A sample's points of a light, `shared` among most; of a dome directions, 0 where its analytic term does."""
    if not isinstance(light, DomeLight):
        return shared
    if _is_plain(settings):
        return 0
    return max(_power_of_two(_FOR_EACH_POINT * settings.light_points / settings.most_samples), _SKY_DIRECTIONS)


def pixel_share(settings: RenderSettings) -> float:
    """Of a pixel, what a sample's highlights stand for; 0 for the plain equation.

    Half of it for one sample: shares are blurred by twice their variance, which suits strewn samples, not one at the
    pixel's centre.
    """
    if _is_plain(settings):
        return 0.0
    return 1.0 / max(settings.most_samples, 2)


def _is_plain(settings: RenderSettings) -> bool:
    """One sample, to which every light is a point?"""
    return settings.most_samples * settings.light_points == 1


def rays_a_sample(settings: RenderSettings) -> int:
    """Of a pixel into a sky, where it has any."""
    return _power_of_two(settings.light_points * _RAYS_FOR_EACH_POINT / settings.most_samples)


def apparent_size(light: Light, bounds: NDArray[np.float64]) -> float:
    """The light's radius over its distance, seen from the middle of the geometry. bounds: (2, 3)."""
    if light.is_infinite or not np.isfinite(bounds).all():
        return light.spread
    distance = float(np.linalg.norm(bounds.mean(axis=0) - light.position))
    return light.spread / max(distance, light.spread) if light.spread > 0.0 else 0.0


def share_points(sizes: Sequence[float], settings: RenderSettings) -> list[int]:
    """Points a sample of each light."""
    large = sum(size > _SMALL for size in sizes)
    most = settings.light_points / settings.most_samples / max(large, 1)
    return [_power_of_two(most * _share(size)) for size in sizes]


def _share(size: float) -> float:
    if size <= _SMALL:
        return 0.0
    return 0.25 if size <= _MIDDLING else 1.0


def _power_of_two(number: float) -> int:
    return 2 ** max(math.floor(math.log2(number)), 0) if number > 1.0 else 1
