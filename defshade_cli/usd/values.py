"""Attribute values as NumPy arrays, without a copy where the type allows it. What is authored may be of any type."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray


def floats(value: object, width: int) -> NDArray[np.float32] | None:
    """(N, width) float32, or (N,) for width 1, of a Vt array or of a lone value; None for anything else."""
    array = np.asarray(value)
    if array.dtype.kind not in "iuf":
        return None
    element = () if width == 1 else (width,)
    if array.shape == element:
        array = array[None]
    if array.shape[1:] != element:
        return None
    if array.dtype == np.float32:
        return array
    with np.errstate(over="ignore"):  # a double out of range becomes inf, which readers look for
        return array.astype(np.float32)


_LONE = (float, int, str)
"""What needs no array to be looked at; a bool is an int."""

FARTHEST = 1e18
"""Where a scene ends: the squares of its lengths are numbers of float32 still."""

STANDS_NOWHERE = f"its transform is not finite, or goes beyond {FARTHEST:g}"


def within_reach(numbers: NDArray[Any]) -> NDArray[np.bool_]:
    """Which (N,) are finite, and no greater than FARTHEST."""
    return np.abs(numbers) <= FARTHEST


def is_finite(value: object) -> bool:
    """No number in `value` is infinite or NaN; what holds no numbers is finite too."""
    if isinstance(value, _LONE):
        return not isinstance(value, float) or math.isfinite(value)
    array = np.asarray(value)
    return array.dtype.kind != "f" or bool(np.isfinite(array).all())


def are_finite(numbers: NDArray[Any]) -> bool:
    """Whether an array (...) is finite. Its squares' sum tells, unless it overflows, which `vdot` does silently."""
    return math.isfinite(np.vdot(numbers, numbers)) or bool(np.isfinite(numbers).all())


def integers(value: object) -> NDArray[np.integer] | None:
    """(N,) integers; None for anything else."""
    array = np.asarray(value)
    return array if array.dtype.kind in "iu" and array.ndim == 1 else None


def is_numbers(value: object) -> bool:
    """Is `value` a number, or are there some in it and nothing else?"""
    array = np.asarray(value)
    return array.dtype.kind in "biuf" and array.size > 0


def resembles(value: object, model: object) -> bool:
    """Is `value` of the kind that `model` is: as many numbers, or the same type?"""
    if isinstance(value, _LONE) and type(value) is type(model):
        return True
    array, like = np.asarray(value), np.asarray(model)
    if like.dtype.kind in "biuf":
        return array.dtype.kind in "biuf" and array.shape == like.shape
    return type(value) is type(model)


def places_in_runs(lengths: NDArray[np.integer]) -> tuple[NDArray[np.intp], NDArray[np.int64]]:
    """(N,) of each element of runs of such lengths (R,), its run, and its place in that."""
    run = np.repeat(np.arange(len(lengths)), lengths)
    return run, np.arange(len(run)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
