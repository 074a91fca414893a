"""Places of a grid drawn in proportion to what each cell weighs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Draw(NamedTuple):
    """A cell and the place within it, both from the top left; chance: of the cell among all."""

    row: int
    column: int
    down: float
    right: float
    chance: float


class GridDistribution:
    """Over the cells of weights (H, W); even where all of them are 0."""

    def __init__(self, weights: NDArray[np.float64]) -> None:
        self._rows = cumulative(weights.sum(axis=1))
        self._columns = cumulative(weights)

    @property
    def chances(self) -> NDArray[np.float64]:
        """(H, W) of each cell."""
        rows, columns = (np.diff(steps, axis=-1, prepend=0.0) for steps in (self._rows, self._columns))
        return rows[:, None] * columns

    def draw(self, u: tuple[float, float]) -> Draw:
        """What a point of the unit square falls on: rows by its first coordinate, columns by its second."""
        row, down = step_at(self._rows, u[0])
        column, right = step_at(self._columns[row], u[1])
        return Draw(row, column, down, right, _height(self._rows, row) * _height(self._columns[row], column))


def cumulative(weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distribution function (..., N) along the last axis; even where all weights are 0."""
    total = weights.sum(axis=-1, keepdims=True)
    even = np.where(total > 0, weights, 1.0)
    return np.cumsum(even, axis=-1) / even.sum(axis=-1, keepdims=True)


def step_at(distribution: NDArray[np.float64], u: float) -> tuple[int, float]:
    """The step of a distribution (N,) that `u` falls on, and how far into it, in [0, 1]."""
    index = min(int(np.searchsorted(distribution, u, side="right")), len(distribution) - 1)
    before = float(distribution[index - 1]) if index else 0.0
    step = float(distribution[index]) - before
    return index, min((u - before) / step, 1.0) if step > 0 else 0.5


def _height(distribution: NDArray[np.float64], index: int) -> float:
    return float(distribution[index] - (distribution[index - 1] if index else 0.0))
