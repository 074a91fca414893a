"""Which meshes are closed: what enters them leaves them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_BLOCK = 2**15
"""Triangles looked at together, whose numbers a processor's cache holds."""

_ODD = tuple(np.uint64(n) for n in (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB))

Numbers = NDArray[np.uint64]


def is_closed(points: NDArray[np.float32], triangles: NDArray[np.uint32]) -> bool:
    """Has each directed edge of triangles (T, 3) its opposite, edges between equal points (V, 3) taken as the same?

    By numbers a, b that are drawn for each point: the sum of a(p) b(q) − b(p) a(q) over the edges pq is 0 where they
    cancel out, and else by a chance of 2⁻⁶⁰ (Schwartz 1980, "Fast Probabilistic Algorithms for Verification of
    Polynomial Identities").
    """
    if not np.isfinite(points).all():
        return False
    first, second = _numbers(points)
    blocks = (triangles[start : start + _BLOCK].T for start in range(0, len(triangles), _BLOCK))
    return not sum(_left_over(first[block], second[block]) for block in blocks) % 2**64


def first_of_equal(points: NDArray[np.float32]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """(N,) numbers of the first of the points (V, 3) at each place, and (V,) which of those places each point has.

    Places that part are told apart but by a chance of V² 2⁻⁶⁵.
    """
    _, first, of = np.unique(_numbers(points)[0], return_index=True, return_inverse=True)
    return first, of


def _left_over(a: Numbers, b: Numbers) -> int:
    """Of the edges of triangles, by the numbers (3, N) of their corners."""
    following = [1, 2, 0]
    return int((a * b[following] - b * a[following]).sum(dtype=np.uint64))


def _numbers(points: NDArray[np.float32]) -> tuple[Numbers, Numbers]:
    """(V,) each, the same for points that are equal."""
    x, y, z = (points + np.float32(0.0)).view(np.uint32).astype(np.uint64).T  # −0 is 0
    first = _mixed(_mixed(_mixed(x) + y) + z)
    return first, _mixed(first + _ODD[0])


def _mixed(numbers: Numbers) -> Numbers:
    """Steele, Lea and Flood 2014, "Fast Splittable Pseudorandom Number Generators": SplitMix64."""
    numbers = numbers + _ODD[0]
    numbers = (numbers ^ numbers >> np.uint64(30)) * _ODD[1]
    numbers = (numbers ^ numbers >> np.uint64(27)) * _ODD[2]
    return numbers ^ numbers >> np.uint64(31)
