"""What the frame before leaves to draw of a frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class Redrawing:
    """reason: why all of the image is drawn; empty where only a part is.

    boxes: (N, 2, 3) world space, around what changed as it was and as it is, and where shadows of it may fall.
    moved: instances that changed.
    by_maps: where shadows of it fall is told by what changes in the shadow maps.
    """

    reason: str = ""
    boxes: NDArray[np.float64] | None = None
    moved: int = 0
    by_maps: bool = False


WHOLE = Redrawing("no frame before it is known")
