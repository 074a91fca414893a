"""Whether the values of a film are numbers: what is NaN or infinite, where, and what can stand in its place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.image.film import Film
from defshade_cli.image.layers import BEAUTY

Mask = NDArray[np.bool_]

_STEP = 16
"""Pixels between those that are looked at first."""


@dataclass(frozen=True, slots=True)
class LayerRange:
    """Least and greatest value of a layer, NaN where it has one."""

    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.low:.4g} to {self.high:.4g}"


@dataclass(frozen=True, slots=True, eq=False)
class FrameCheck:
    """ranges: by layer.  odd: (height, width) masks by layer, of the layers that hold what is no number.

    beauty: (height, width, 4), if the film has one.
    """

    ranges: Mapping[str, LayerRange]
    odd: Mapping[str, NDArray[np.bool_]]
    beauty: NDArray[np.float32] | None

    @property
    def black(self) -> float:
        """Share of the beauty's covered pixels without any light; 0 without a beauty."""
        if self.beauty is None:
            return 0.0
        return float(_is_dark(self.beauty).sum() / max((self.beauty[..., 3] > 0.0).sum(), 1))

    @property
    def is_black(self) -> bool:
        """Is all that is covered without any light? A few pixels tell of most images that it is not."""
        if self.beauty is None:
            return False
        some = self.beauty[::_STEP, ::_STEP]
        return not ((some[..., 3] > 0.0) & ~_is_dark(some)).any() and self.black == 1.0

    def __str__(self) -> str:
        layers = ", ".join(f"{name} {spread}" for name, spread in self.ranges.items())
        return f"{layers}; {self.black:.0%} of what is covered is black"


def check(film: Film) -> FrameCheck:
    """NaN is odd anywhere, infinity in colours: depth and its like have it for a background."""
    ranges = {name: _range(pixels) for name, pixels in film.layers.items()}
    odd = {name: mask for name in ranges if (mask := _odd(film, name, ranges[name])) is not None}
    return FrameCheck(ranges, odd, film.layers.get(BEAUTY))


def filled(film: Film, odd: Mapping[str, NDArray[np.bool_]]) -> Film:
    """The film with the value of the nearest sound pixel in each odd one (H, W); 0 where none is sound."""
    return replace(film, layers=film.layers | {name: _filled(film.layers[name], mask) for name, mask in odd.items()})


def _range(pixels: NDArray[np.float32]) -> LayerRange:
    return LayerRange(float(pixels.min()), float(pixels.max()))


def _odd(film: Film, name: str, spread: LayerRange) -> Mask | None:
    """The odd pixels, sought only where the range tells of some."""
    bounds = np.array([spread.low, spread.high])
    wrong = np.isnan if not film.rows[name].is_color else lambda values: ~np.isfinite(values)
    return np.any(wrong(film.layers[name]), axis=-1) if wrong(bounds).any() else None


def _is_dark(beauty: NDArray[np.float32]) -> Mask:
    """(H, W) where covered pixels have no light."""
    light = beauty[..., :3]
    return np.asarray((beauty[..., 3] > 0.0) & (light[..., 0] <= 0.0) & (light[..., 1] <= 0.0) & (light[..., 2] <= 0.0))


def _filled(pixels: NDArray[np.float32], odd: NDArray[np.bool_]) -> NDArray[np.float32]:
    from scipy.ndimage import distance_transform_edt

    if odd.all():
        return np.zeros_like(pixels)
    rows, columns = distance_transform_edt(odd, return_distances=False, return_indices=True)
    return np.asarray(pixels[rows, columns])
