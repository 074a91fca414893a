"""Which pixels geometry covers, in our pictures and in those of others, and how well the two agree.

A pixel belongs to the silhouette where half of it or more is covered. With an alpha channel, coverage is alpha over the
greatest alpha around the pixel, so that transparent things have silhouettes too. Without one it is the pixel's
distance from the background's colour over the greatest distance around it: an edge pixel is a mixture of the
background and of what its neighbour shows whole.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

Mask = NDArray[np.bool_]

_NEIGHBOURS = 3
_HALF = 0.375
"""Between one and two of four samples, so that no rounding decides."""

_ALPHA_NOISE = 0.02
_COLOR_NOISE = 4.0 / 255.0
"""What quantisation and dithering may make of an even background."""


def mask_of_alpha(alpha: NDArray) -> Mask:
    """(H, W) True where half of the pixel or more is covered."""
    return _half_of_greatest(alpha.astype(np.float64), _ALPHA_NOISE)


def mask_of_color(rgb: NDArray, background: tuple[float, float, float]) -> Mask:
    """The same of an opaque picture (H, W, 3) in [0, 1] over an even background."""
    distance = np.abs(rgb.astype(np.float64) - background).max(axis=-1)
    return _half_of_greatest(distance, _COLOR_NOISE)


def intersection_over_union(a: Mask, b: Mask) -> float:
    """|a ∩ b| / |a ∪ b|; 1 for two that are empty."""
    union = np.count_nonzero(a | b)
    return np.count_nonzero(a & b) / union if union else 1.0


def _half_of_greatest(amount: NDArray[np.float64], noise: float) -> Mask:
    greatest = maximum_filter(amount, _NEIGHBOURS)
    return (amount > noise) & (amount > _HALF * greatest)
