"""Data that no eye could read, as colours in [0, 1]."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float32]


def colors_of_ids(bits: NDArray[np.uint32]) -> Pixels:
    """(..., 3) a colour for each number, the same in every picture; by Wellons' lowbias32 hash."""
    x = bits.astype(np.uint32)
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B), (16, 1)):
        x = (x ^ x >> np.uint32(shift)) * np.uint32(factor)
    channels = np.stack([x, x >> np.uint32(8), x >> np.uint32(16)], axis=-1) & np.uint32(255)
    return (0.2 + channels / 255.0 * 0.8).astype(np.float32)


def show_ids(pixels: Pixels, background: float) -> Pixels:
    """(H, W, 1) whole numbers → (H, W, 3), the background black."""
    ids = pixels[..., 0]
    colors = colors_of_ids(ids.astype(np.int64).astype(np.uint32))
    return np.where((ids == background)[..., None], np.float32(0.0), colors)


def show_matte(pixels: Pixels) -> Pixels:
    """(H, W, 2 · ranks) of a Cryptomatte → (H, W, 3): the colours of its ids, each by its coverage."""
    ids, coverage = np.ascontiguousarray(pixels[..., ::2]), pixels[..., 1::2]
    return np.einsum("hwrc,hwr->hwc", colors_of_ids(ids.view(np.uint32)), coverage)


def show_vectors(pixels: Pixels) -> Pixels:
    """(H, W, 2) → (H, W, 3): red grows to the right and green up, grey is none; the longest reaches the end."""
    longest = float(np.abs(pixels).max(initial=0.0)) or 1.0
    return np.concatenate([0.5 + 0.5 * pixels / longest, np.full_like(pixels[..., :1], 0.5)], axis=-1)


def show_coordinates(pixels: Pixels) -> Pixels:
    """(H, W, 2) → (H, W, 3): every tile of texture coordinates in red and green alike."""
    return np.concatenate([pixels % 1.0, np.zeros_like(pixels[..., :1])], axis=-1)
