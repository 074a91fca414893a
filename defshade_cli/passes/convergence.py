"""How far an image is from its limit, tile by tile, and which tiles need more samples.

The error of a tile is the root mean square of its pixels' standard errors over its mean luminance, both of luminance;
tiles darker than a tenth of the image's mean count as that bright, or noise that nobody sees would hold the render up.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.passes.frame import Size

TILE = 32
"""Pixels a side."""
QUANTILE = 95.0
"""Per cent of the tiles whose errors are at most the image's."""
FEWEST = 16
"""Samples before any tile can be done: from fewer, batches tell too little."""

_DARKEST = 0.1


class Convergence:
    """Errors and numbers of samples of tiles. max_error: what a tile is done at; None for never.

    active, error, samples: (rows, columns) which tiles still get samples, their relative errors as last known, and the
    samples that they had then.
    """

    def __init__(self, size: Size, max_error: float | None) -> None:
        width, height = size
        self._edges = np.arange(0, height, TILE), np.arange(0, width, TILE)
        self._size, self._max_error = size, max_error
        grid = len(self._edges[0]), len(self._edges[1])
        self.active = np.ones(grid, bool)
        self.samples = np.zeros(grid, np.int32)
        self.error = np.full(grid, np.inf)
        self._luminance = np.zeros(grid)

    @property
    def estimate(self) -> float:
        """The image's relative error: no more than QUANTILE per cent of the tiles have a smaller one."""
        return float(np.percentile(self.error, QUANTILE, method="higher"))

    @property
    def has_arrived(self) -> bool:
        """Whether the estimated error is as small as was asked."""
        return self._max_error is not None and self.estimate <= self._max_error

    def judge(self, luminance: NDArray[np.float32], variance: NDArray[np.float32], samples: int) -> None:
        """Learn the (height, width, 1) mean luminances and variances after `samples`; finished tiles keep theirs."""
        active = self.active
        self.samples[active] = samples
        self._luminance[active] = self._tile_means(luminance)[active]
        level = np.maximum(np.abs(self._luminance), _DARKEST * np.abs(self._luminance).mean())
        deviation = np.sqrt(self._tile_means(variance))
        error = np.divide(deviation, level, out=np.zeros_like(level), where=deviation > 0.0)
        self.error[active] = error[active]
        if self._max_error is not None and samples >= FEWEST:
            self.active = active & (self.error > self._max_error)

    def sample_count(self) -> NDArray[np.int32]:
        """(height, width, 1) samples that each pixel got."""
        width, height = self._size
        if self.samples.min() == self.samples.max():
            return np.broadcast_to(self.samples[0, 0], (height, width, 1))
        return self.samples.repeat(TILE, 0)[:height].repeat(TILE, 1)[:, :width, None]

    def _tile_means(self, values: NDArray[np.float32]) -> NDArray[np.float64]:
        rows, columns = self._edges
        sums = np.add.reduceat(np.add.reduceat(values[..., 0].astype(np.float64), rows, 0), columns, 1)
        width, height = self._size
        return sums / np.outer(np.diff([*rows, height]), np.diff([*columns, width]))
