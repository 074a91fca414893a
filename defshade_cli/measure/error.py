"""How far a rendered image is from the reference."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class RelativeError:
    """Percentiles over lit pixels of the greatest channel's |image − reference| / mean reference.

    lit: pixels that entered.
    """

    median: float
    p99: float
    p999: float
    worst: float
    lit: int


def relative_error(image: NDArray[Any], reference: NDArray[Any], *, floor: float = 1e-3) -> RelativeError:
    """Compare (H, W, 3) radiance pixel by pixel.

    A pixel is lit where the reference's mean channel passes `floor` of the image's 99th percentile: below,
    a relative error says nothing that an eye or a compositor would see. Without lit pixels
    there is no error.
    """
    errors = relative_differences(image, reference, floor=floor)
    if not len(errors):
        return RelativeError(0.0, 0.0, 0.0, 0.0, 0)
    median, p99, p999 = np.percentile(errors, [50.0, 99.0, 99.9], method="higher")
    return RelativeError(float(median), float(p99), float(p999), float(errors.max()), len(errors))


def relative_differences(image: NDArray[Any], reference: NDArray[Any], *, floor: float = 1e-3) -> NDArray[np.float64]:
    """(L,) the error of each lit pixel; NaN in the image counts as infinite."""
    level = reference.astype(np.float64).mean(axis=-1)
    positive = level[level > 0.0]
    lit = level > (floor * np.percentile(positive, 99.0) if len(positive) else 0.0)
    difference = np.abs(image.astype(np.float64) - reference).max(axis=-1)
    return np.nan_to_num(difference[lit] / level[lit], nan=np.inf)
