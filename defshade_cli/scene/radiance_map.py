"""The image that a light's surface shows: how it is sampled, and its mean."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.arrays import frozen
from defshade_cli.scene.distribution import GridDistribution
from defshade_cli.scene.environment import LUMINANCE

_MOST_CELLS = 512
"""Rows and columns that points are drawn from; a finer image is averaged into them."""


@dataclass(frozen=True, eq=False)
class RadianceMap:
    """radiance: (H, W, 3) float32, scene-linear, row 0 at the top; it multiplies the light's."""

    radiance: NDArray[np.float32]

    def __post_init__(self) -> None:
        object.__setattr__(self, "radiance", frozen(self.radiance, np.float32, *self.radiance.shape[:2], 3))

    @cached_property
    def mean(self) -> NDArray[np.float64]:
        """(3,) over the surface."""
        return self.radiance.mean(axis=(0, 1), dtype=np.float64)

    def sample(self, u: tuple[float, float]) -> tuple[tuple[float, float], NDArray[np.float64], float]:
        """A place drawn in proportion to luminance, the radiance there over density and mean, (3,), and the density.

        The place is in [0, 1]², from the image's left and top. The second has a mean of 1 over samples, or 0 where a
        channel is black.
        """
        height, width = self._cells.shape[:2]
        row, column, down, right, chance = self._distribution.draw(u)
        place = ((column + right) / width, (row + down) / height)
        density = chance * height * width
        if density == 0.0:
            return place, np.zeros(3), 1.0
        return place, self._relative[row, column] / density, density

    @cached_property
    def cells(self) -> NDArray[np.float32]:
        """(h, w, 4) that places are drawn from, row 0 at the top: radiance over its mean, and their density."""
        density = self._distribution.chances * self._cells[..., 0].size
        return np.concatenate([self._relative, density[..., None]], axis=2).astype(np.float32)

    @cached_property
    def _relative(self) -> NDArray[np.float64]:
        return np.divide(self._cells, self.mean, out=np.zeros_like(self._cells), where=self.mean > 0)

    @cached_property
    def _cells(self) -> NDArray[np.float64]:
        """(h, w, 3) the image averaged over cells of equal size, by the integral up to their edges."""
        cells = self.radiance.astype(np.float64)
        for axis in (0, 1):
            cells = _averaged(cells, axis)
        return cells

    @cached_property
    def _distribution(self) -> GridDistribution:
        return GridDistribution(np.maximum(self._cells @ LUMINANCE, 0.0))


def _averaged(image: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """No more than _MOST_CELLS along `axis`, each the mean of what it covers."""
    count = image.shape[axis]
    if count <= _MOST_CELLS:
        return image
    rows = np.moveaxis(image, axis, 0)
    integral = np.concatenate([np.zeros((1, *rows.shape[1:])), np.cumsum(rows, axis=0)])
    edges = np.linspace(0, count, _MOST_CELLS + 1)
    whole = np.minimum(edges.astype(int), count - 1)
    part = (edges - whole).reshape(-1, *[1] * (rows.ndim - 1))
    up_to = integral[whole] + part * rows[whole]
    return np.moveaxis(np.diff(up_to, axis=0) * (_MOST_CELLS / count), 0, axis)
