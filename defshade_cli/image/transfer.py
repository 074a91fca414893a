"""The curve by which sRGB encodes light."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def linear(encoded: NDArray[Any]) -> NDArray[Any]:
    """Light of sRGB's values (..., C), 1 for white, in their shape: IEC 61966-2-1."""
    curved = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, curved)
