"""Arrays that scene data may share: checked for shape, contiguous, read-only."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray


def frozen(values: Any, dtype: DTypeLike, *shape: int) -> NDArray[Any]:
    """`values` as a C-contiguous, read-only array (...) of `dtype`; −1 in `shape` stands for any length.

    Raises ValueError where the shape differs. Copies only where it must; the caller's array stays writable.
    """
    array = np.ascontiguousarray(values, dtype=dtype)
    found = array.shape
    if shape != found and (len(shape) != len(found) or not all(map(_fits, shape, found))):
        raise ValueError(f"expected shape {shape}, got {found}")
    if not array.flags.writeable:
        return array
    array = array.view()
    array.flags.writeable = False
    return array


def _fits(wanted: int, found: int) -> bool:
    return wanted in (-1, found)
