"""Corners that stand at one point with the same values, made one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_MOST_ROUNDS = 256
"""Different values at one point that are looked for; what is left after them stays apart."""


def weld(points: NDArray[np.integer], values: NDArray[np.float32]) -> tuple[NDArray[np.int32], NDArray[np.intp]]:
    """(C,) a number for each corner, the same for corners at one point with equal values, and (N,) a corner of each.

    points: (C,) of each corner.  values: (C, ...), compared bit by bit, so that NaN equals itself.
    In every round some corner stands for each point, and takes those that equal it: as many rounds as a point has
    different values, where sorting the values would take longer than many rounds.
    """
    bits = np.ascontiguousarray(values, np.float32).view(np.uint32).reshape(len(points), -1)
    stands_for = np.arange(len(points))
    speaker = np.zeros(int(points.max(initial=-1)) + 1, np.intp)
    left = stands_for
    for _ in range(_MOST_ROUNDS):
        if not len(left):
            break
        speaker[points[left]] = left
        spoken = speaker[points[left]]
        same = (bits[left] == bits[spoken]).all(axis=1)
        stands_for[left[same]] = spoken[same]
        left = left[~same]
    chosen, number = np.unique(stands_for, return_inverse=True)
    return number.astype(np.int32), chosen
