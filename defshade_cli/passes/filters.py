"""Pixel filters by importance sampling: where in or around its pixel a sample falls, so that all count alike.

Ernst, Stamminger & Greiner 2006, "Filter Importance Sampling": a sample at a place drawn from the filter, weighted by
nothing, has the filtered image as its expectation. Every sample stays in its own pixel; nothing is splatted. The
filters are separable, and each inverse of a cumulative distribution is exact to rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from defshade_cli.settings import Filter

_GAUSSIAN_ENDS = 2.0  # standard deviations: exp(−2 (2x/width)²), as in the RenderMan Interface 3.2 §11.2
_BLACKMAN_HARRIS = (0.35875, 0.48829, 0.14128, 0.01168)  # Harris 1978, the four terms with the least side lobes
_BISECTIONS = 53


def filter_offset(kind: Filter, width: float, u: tuple[float, float]) -> tuple[float, float]:
    """Pixels from a pixel's centre, for `u` in the unit square; (0, 0) for its middle."""
    inverse = _INVERSES[kind]
    return width * inverse(u[0]), width * inverse(u[1])


def _box(u: float) -> float:
    return u - 0.5


def _gaussian(u: float) -> float:
    from statistics import NormalDist

    normal = NormalDist()
    low = normal.cdf(-_GAUSSIAN_ENDS)
    return normal.inv_cdf(low + u * (1.0 - 2.0 * low)) / (2.0 * _GAUSSIAN_ENDS)


def _blackman_harris(u: float) -> float:
    low, high = -0.5, 0.5
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if blackman_harris_cdf(middle) < u else (low, middle)
    return 0.5 * (low + high)


def blackman_harris_cdf(t: float) -> float:
    """The share of the window before t, in widths from its centre: the integral of its cosines."""
    a0, *rest = _BLACKMAN_HARRIS
    waves = sum(a * math.sin(math.tau * k * t) / (math.tau * k) for k, a in enumerate(rest, start=1))
    return 0.5 + t + waves / a0


_INVERSES: dict[Filter, Callable[[float], float]] = {
    "box": _box,
    "gaussian": _gaussian,
    "blackman-harris": _blackman_harris,
}
"""From a share of the filter to widths from its centre."""
