"""Which pixels geometry covers, in our pictures and in those of others, and how well the two agree.

    alpha    covered where alpha is above a threshold
    colour   covered where an opaque picture shows anything else than its even background, which is read off its corners

Storm takes four samples of a pixel, at places that are known. Taken at the same places ours cover the same samples, so
that a pixel counts as soon as one of them is covered, whatever colour it has. Arnold filters many samples over
neighbouring pixels: there a pixel counts where half of it is covered.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

_DRAWS = 1000

Mask = NDArray[np.bool_]
Color = tuple[float, float, float]

ANY_SAMPLE, HALF = 0.003, 0.5
"""Thresholds of alpha: something of a pixel, and half of it."""

_STEP = 1.0 / 255.0


def mask_of_alpha(alpha: NDArray[Any], threshold: float) -> Mask:
    """(H, W)"""
    return alpha > threshold


def mask_of_color(rgb: NDArray[Any], background: Color) -> Mask:
    """(H, W) of a picture (H, W, 3) in [0, 1]; a difference of one step of 8 bits is rounding."""
    return np.abs(rgb.astype(np.float64) - background).max(axis=-1) > 1.5 * _STEP


def even_background(rgb: NDArray[Any]) -> Color | None:
    """The colour (3,) of all four corners; None where they differ."""
    corners = rgb[[0, 0, -1, -1], [0, -1, 0, -1]].astype(np.float64)
    if (np.abs(corners - corners[0]) > 1.5 * _STEP).any():
        return None
    r, g, b = corners[0].tolist()
    return r, g, b


def intersection_over_union(a: Mask, b: Mask) -> float:
    """|a ∩ b| / |a ∪ b|; 1 for two that are empty."""
    union = np.count_nonzero(a | b)
    return np.count_nonzero(a & b) / union if union else 1.0


class Noise(NamedTuple):
    """IoU of a silhouette with itself as `samples` random samples a pixel have it: 1 % are less than `low`."""

    samples: int
    low: float
    mean: float


def noise_of(alpha: NDArray[Any], samples: int, threshold: float) -> Noise:
    """What chance alone costs a picture that covers pixels by so much (H, W)."""
    silhouette = mask_of_alpha(alpha, threshold)
    at_border = (alpha > 0.0) & (alpha < 1.0)
    draws = np.random.default_rng(0).binomial(samples, alpha[at_border], (_DRAWS, np.count_nonzero(at_border)))
    drawn, exact = mask_of_alpha(draws / samples, threshold), silhouette[at_border]
    inside = np.count_nonzero(silhouette & ~at_border)
    common, either = ((inside + np.count_nonzero(each, axis=1)) for each in (drawn & exact, drawn | exact))
    agreeing = np.divide(common, either, out=np.ones(_DRAWS), where=either > 0)
    return Noise(samples, float(np.quantile(agreeing, 0.01)), float(agreeing.mean()))
