"""Which geometry a light lights, and which casts its shadows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.arrays import frozen


@dataclass(frozen=True, slots=True, eq=False)
class Links:
    """lights, casts: (S,) bool by link set; placements that all lights treat alike share a set (Drawable.link_sets)."""

    lights: NDArray[np.bool_]
    casts: NDArray[np.bool_]

    def __post_init__(self) -> None:
        object.__setattr__(self, "lights", frozen(self.lights, np.bool_, -1))
        object.__setattr__(self, "casts", frozen(self.casts, np.bool_, len(self.lights)))
