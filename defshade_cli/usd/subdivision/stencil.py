"""Sparse weights: masks lead from one level to the next, stencils from the control mesh to any."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from defshade_cli.dataclass import dataclass

if TYPE_CHECKING:  # scipy is a quarter of a second to import, and not every stage is subdivided
    from scipy import sparse

Masks: TypeAlias = "sparse.csr_array"
Entries: TypeAlias = tuple[NDArray[Any], NDArray[Any], ArrayLike]
"""(rows, columns, weights); a single weight stands for all."""


def assemble(shape: tuple[int, int], *entries: Entries) -> Masks:
    """The matrix that sums all entries; those at one place add up, and zeros leave no trace."""
    from scipy import sparse

    rows, columns, weights = zip(*map(_used, entries), strict=True)
    places = np.concatenate(rows, dtype=np.int32), np.concatenate(columns, dtype=np.int32)
    return sparse.csr_array((np.concatenate(weights), places), shape=shape)


def _used(entries: Entries) -> tuple[NDArray[Any], NDArray[Any], NDArray[np.float64]]:
    rows, columns = entries[:2]
    weights = np.broadcast_to(np.asarray(entries[2], np.float64), rows.shape)
    used = np.flatnonzero(weights)
    return (rows, columns, weights) if len(used) == len(rows) else (rows[used], columns[used], weights[used])


def applied(masks: Masks, values: NDArray[Any]) -> NDArray[Any]:
    """(rows, ...) values from (columns, ...) ones."""
    if values.ndim <= 2:
        return masks @ values
    flat: NDArray[Any] = masks @ values.reshape(len(values), -1)
    return flat.reshape(-1, *values.shape[1:])


def identity(count: int) -> Masks:
    """The masks (count, count) that change nothing."""
    from scipy import sparse

    return sparse.csr_array(sparse.identity(count, format="csr"))


@dataclass(frozen=True, eq=False, slots=True)
class Stencils:
    """Masks applied in turn, the first to control values: `stencils @ points`.

    Their product would have more entries than they, and take longer to make than many frames to refine.
    """

    masks: tuple[Masks, ...]

    def __matmul__(self, values: NDArray[Any]) -> NDArray[np.float64]:
        """(N, ...) values from (control N, ...) ones."""
        return reduce(lambda finer, mask: applied(mask, finer), self.masks, np.asarray(values, np.float64))

    def then(self, mask: Masks) -> Stencils:
        """The stencils with one more mask (rows, columns) applied."""
        return Stencils((*self.masks, mask))

    @property
    def matrix(self) -> Masks:
        """(N, control N) the product."""
        return reduce(lambda product, mask: mask @ product, self.masks)
