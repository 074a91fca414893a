"""Arrays that scene data may share: checked for shape, contiguous, read-only."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray


def frozen(values: Any, dtype: DTypeLike, *shape: int) -> NDArray:
    """`values` as a C-contiguous, read-only array of `dtype`; −1 in `shape` stands for any length.

    Raises ValueError where the shape differs. Copies only where it must; the caller's array stays writable.
    """
    array = np.ascontiguousarray(values, dtype=dtype)
    if len(shape) != array.ndim or any(want not in (-1, have) for want, have in zip(shape, array.shape, strict=True)):
        raise ValueError(f"expected shape {shape}, got {array.shape}")
    array = array.view()
    array.flags.writeable = False
    return array
