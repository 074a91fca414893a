"""Where shadows fall otherwise than in the frame before, by what changed in shadow maps that both frames have.

A map is looked at in blocks of texels. Where some texel of a block changed, a receiver there looks the same if it lies
behind all that any of them showed or shows, or before all of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.geometry import box_corners
from defshade_cli.spaces import Matrix

Region = tuple[int, int, int, int]
"""Of a map: x, y, width and height in texels."""

_BEFORE, _BEHIND = 3, 2
"""Texels before the one at a look-up's place and behind it that it may read; one more than it does, for rounding."""

_LEAST_BLOCK, _MOST_BLOCKS = 8, 64
_ROUNDING = 2
"""Texels around what is drawn: what float32 and the raster's grid may move a corner, and more."""

_DEPTH, _LEAST_DEPTH = 1e-4, 1e-6
"""What float32 may move a receiver's stored depth in the shaders: of it, and at least."""

_BEYOND = 4.0
"""Times the range of depths around a receiver: a surface that goes on from there passes it by 3 1/16 at most."""


@dataclass(frozen=True, slots=True, eq=False)
class MapChange:
    """places_from_relative: (4, 4) to texels of the map and stored depth, times w.

    block: texels along the side of a block.  columns, rows: (K,) of blocks that changed.
    near, far: (K,) stored depths between which receivers there may look otherwise; near ones are greater.
    """

    places_from_relative: Matrix
    resolution: int
    block: int
    columns: NDArray[np.int64]
    rows: NDArray[np.int64]
    near: NDArray[np.float64]
    far: NDArray[np.float64]

    def grid(self) -> tuple[NDArray[np.float32], tuple[int, int]]:
        """(rows, columns, 2) near and far of all blocks around those that changed, and the first one's column and row.

        What did not change has a near that is farther than its far.
        """
        first = int(self.columns.min()), int(self.rows.min())
        blocks = np.full((np.ptp(self.rows) + 1, np.ptp(self.columns) + 1, 2), [-np.inf, np.inf], np.float32)
        blocks[self.rows - first[1], self.columns - first[0]] = np.column_stack([self.near, self.far])
        return blocks, first

    def all_behind(self) -> MapChange:
        """The same where what casts a shadow says how deep it is."""
        return replace(self, far=np.full_like(self.far, -np.inf))


@dataclass(frozen=True, slots=True, eq=False)
class MapWindow:
    """Of a map, what must be drawn anew, and what must be known around it to tell what changes by that.

    drawn, read: regions.  first: column and row of the first block.  count: blocks across and down.
    """

    drawn: Region
    read: Region
    block: int
    first: tuple[int, int]
    count: tuple[int, int]


def window_of(boxes: NDArray[np.float64], places_from_relative: Matrix, resolution: int) -> MapWindow | None:
    """Around boxes (N, 2, 3) relative to the eye, as a map sees them; None where it sees none of them."""
    found = _rectangles(boxes, places_from_relative, resolution)[0]
    found = found[(found[:, 0] < found[:, 2]) & (found[:, 1] < found[:, 3])]
    if not len(found):
        return None
    (x, y), (right, bottom) = found[:, :2].min(axis=0).tolist(), found[:, 2:].max(axis=0).tolist()
    block = _LEAST_BLOCK
    while max(right - x, bottom - y) > block * _MOST_BLOCKS:
        block *= 2
    first = (x - _BEHIND) // block, (y - _BEHIND) // block
    end = (right - 1 + _BEFORE) // block + 1, (bottom - 1 + _BEFORE) // block + 1
    low = [max(f * block - _BEFORE, 0) for f in first]
    high = [min(e * block + _BEHIND, resolution) for e in end]
    return MapWindow(
        (x, y, right - x, bottom - y),
        (low[0], low[1], high[0] - low[0], high[1] - low[1]),
        block,
        first,
        (end[0] - first[0], end[1] - first[1]),
    )


def map_change(
    old: NDArray[np.float32],
    new: NDArray[np.float32],
    window: MapWindow,
    places_from_relative: Matrix,
    resolution: int,
) -> MapChange | None:
    """By the stored depths (H, W) of what is read of the window; None where nothing changed."""
    changed = _by_block(old != new, window, np.logical_or)
    rows, columns = np.nonzero(changed)
    if not len(rows):
        return None
    least = _by_block(np.minimum(old, new), window, np.minimum)[changed].astype(np.float64)
    most = _by_block(np.maximum(old, new), window, np.maximum)[changed].astype(np.float64)
    beyond = _BEYOND * (most - least) + _DEPTH * most + _LEAST_DEPTH
    return MapChange(
        places_from_relative,
        resolution,
        window.block,
        columns + window.first[0],
        rows + window.first[1],
        most + beyond,
        least - beyond,
    )


def _by_block(values: NDArray[Any], window: MapWindow, extreme: np.ufunc) -> NDArray[Any]:
    """(rows, columns): the extreme of what look-ups in each block may read; the map's edge goes on beyond it."""
    for low, first, count in zip(window.read[1::-1], window.first[::-1], window.count[::-1], strict=True):
        start, length = (first - 1) * window.block, (count + 2) * window.block
        behind = length - (low - start) - len(values)
        padded = np.pad(values, [(low - start, behind), (0, 0)], mode="edge")
        blocks = padded.reshape(count + 2, window.block, -1)
        within, last, next_ = (extreme.reduce(b, axis=1) for b in (blocks, blocks[:, -_BEFORE:], blocks[:, :_BEHIND]))
        values = extreme(within[1:-1], extreme(last[:-2], next_[2:])).T
    return values


def maps_that_change(
    boxes: NDArray[np.float64], changes: Sequence[MapChange], relative_from_boxes: Matrix
) -> NDArray[np.bool_]:
    """(M, N): by which of the changes (M,) may shadows on something in each of the boxes (N, 2, 3) look otherwise?"""
    found = np.zeros((len(changes), len(boxes)), bool)
    for met, change in zip(found, changes, strict=True):
        matrix = change.places_from_relative @ relative_from_boxes
        met[_meet(change, *_rectangles(boxes, matrix, change.resolution))] = True
    return found


def _meet(change: MapChange, rectangles: NDArray[np.int64], depths: NDArray[np.float64]) -> NDArray[np.int64]:
    """Which of the rectangles (N, 4) at depths (N, 2) meet a block that changed."""
    low, high = rectangles[:, :2] // change.block, (rectangles[:, 2:] - 1) // change.block
    around = np.array([[change.columns.min(), change.rows.min()], [change.columns.max(), change.rows.max()]])
    near = np.flatnonzero((low <= around[1]).all(axis=1) & (high >= around[0]).all(axis=1))
    low, high, depths = low[near, :, None], high[near, :, None], depths[near, :, None]
    met = (low[:, 0] <= change.columns) & (change.columns <= high[:, 0])
    met &= (low[:, 1] <= change.rows) & (change.rows <= high[:, 1])
    met &= (depths[:, 0] <= change.near) & (change.far <= depths[:, 1])
    return near[met.any(axis=1)]


def _rectangles(
    boxes: NDArray[np.float64], matrix: Matrix, resolution: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """(N, 4) left, top, right and bottom in texels around boxes (N, 2, 3), and (N, 2) their range of stored depth.

    Boxes that the map does not see have a rectangle without texels, those beside its eye all of the map.
    """
    corners = box_corners(boxes) @ matrix[:, :3].T + matrix[:, 3]
    w = corners[..., 3]
    beside, ahead = (w <= 1e-6 * np.abs(corners).max(axis=2)).any(axis=1), (w > 0.0).any(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = corners[..., :3] / w[..., None]
    low, high = seen.min(axis=1), seen.max(axis=1)
    low[beside, :2], high[beside, :2] = 0.0, resolution
    low[beside, 2], high[beside, 2] = -np.inf, np.inf
    edges = np.hstack([np.floor(low[:, :2]) - _ROUNDING, np.ceil(high[:, :2]) + _ROUNDING])
    edges[~ahead] = 0.0
    rectangles = np.clip(np.nan_to_num(edges, nan=0.0), 0, resolution).astype(np.int64)
    return rectangles, np.column_stack([low[:, 2], high[:, 2]])
