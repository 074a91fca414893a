"""Points that are as even as few can be: on round shapes a spiral, on rectangles a lattice whose edges are kept too."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

Triple = tuple[float, float, float]

MOST_ON_LATTICE = 64
"""Points; more of them gain nothing by it."""

_GOLDEN, _ROOT_3 = 0.6180339887498949, 0.7320508075688772
_SHIFTS = 16


def spiral(k: int, count: int) -> Triple:
    """The k-th of `count` points: multiples of the golden ratio, whose second coordinate joins at its ends.

    On a disk's polar coordinates this is the spiral of a sunflower (Vogel 1979); multiples of √3 serve for depth.
    """
    return (k + 0.5) / count, (0.5 + k * _GOLDEN) % 1.0, (0.5 + k * _ROOT_3) % 1.0


def even_grid(k: int, count: int) -> Triple:
    """The same on a square, where each row and each column of `count` holds one; the spiral's if more than 64."""
    if count > MOST_ON_LATTICE:
        return spiral(k, count)
    generator, shift = _most_even(count)
    return (k + 0.5) / count, ((k * generator + shift) % count + 0.5) / count, (0.5 + k * _ROOT_3) % 1.0


@cache
def _most_even(count: int) -> tuple[int, int]:
    """Generator and shift of the rank-1 lattice with the least mixture discrepancy."""
    k, step = np.arange(count), max(count // _SHIFTS, 1)
    pairs = [(g, s) for g in range(1, count + 1) if math.gcd(g, count) == 1 for s in range(0, count, step)]
    rows = np.array([(k * generator + shift) % count for generator, shift in pairs])
    points = (np.stack(np.broadcast_arrays(k, rows), axis=-1) + 0.5) / count
    return min(zip(map(_mixture_discrepancy, points), pairs, strict=True))[1]


def _mixture_discrepancy(points: NDArray[np.float64]) -> float:
    """Squared, of (N, 2) points. Zhou, Fang and Ning 2013, "Mixture discrepancy for quasi-random point sets"."""
    off = np.abs(points - 0.5)
    x, y, apart = off[:, None], off[None], np.abs(points[:, None] - points[None])
    alone = np.prod(5 / 3 - 0.25 * off - 0.25 * off * off, axis=-1).mean()
    together = np.prod(15 / 8 - 0.25 * (x + y) - 0.75 * apart + 0.5 * apart * apart, axis=-1).mean()
    return float((19 / 12) ** 2 - 2.0 * alone + together)
