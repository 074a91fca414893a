"""Which lights each tile of the image may be lit by: their volumes against the tiles' boxes, in camera space.

A tile's box holds all that its pixels see, between its nearest and its farthest depth. Boxes are tested in two steps,
8 x 8 tiles together first. The lists may name a light too many, never one too few.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.plan.bounds import ROUNDING, LightBounds
from defshade_cli.spaces import Window

TILE = 16
"""Pixels a side."""

_BLOCK = 8


def tile_grid(size: tuple[int, int], side: int = TILE) -> tuple[int, int]:
    """(columns, rows) of the tiles of an image of (width, height), or of others that are so many pixels a side."""
    return -(-size[0] // side), -(-size[1] // side)


@dataclass(frozen=True, slots=True, eq=False)
class LightLists:
    """runs: (rows, columns, 2) each tile's first entry in `lights`, and how many it has.

    lights: numbers, ascending within a run.
    """

    runs: NDArray[np.uint32]
    lights: NDArray[np.uint32]


def list_lights(bounds: LightBounds, boxes: NDArray[np.float64], hidden: NDArray[np.bool_] | None = None) -> LightLists:
    """Of (rows, columns, 2, 3) boxes. hidden: (rows, columns, L) lights that do not arrive there, where it is known."""
    blocks, members = _blocks(boxes)
    light, block = (each.ravel() for each in np.indices((len(bounds), len(blocks))))
    near = bounds.meet(light, blocks[block])
    light, block = light[near], block[near]
    tile, light = members[block].ravel(), light.repeat(members.shape[1])
    light, tile = light[tile >= 0], tile[tile >= 0]
    if hidden is not None:
        arrive = ~hidden.reshape(-1, len(bounds))[tile, light]
        light, tile = light[arrive], tile[arrive]
    near = bounds.meet(light, boxes.reshape(-1, 2, 3)[tile])
    tile, light = np.divmod(np.sort(tile[near] * len(bounds) + light[near]), max(len(bounds), 1))
    counts = np.bincount(tile, minlength=boxes[..., 0, 0].size)
    runs = np.stack([np.cumsum(counts) - counts, counts], axis=-1)
    return LightLists(runs.reshape(*boxes.shape[:2], 2).astype(np.uint32), light.astype(np.uint32))


def _blocks(boxes: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(B, 2, 3) boxes of blocks of tiles, and (B, 64) numbers of their tiles, −1 beyond the image."""
    rows, columns = boxes.shape[:2]
    down, across = -(-rows // _BLOCK), -(-columns // _BLOCK)
    numbers = np.full((down * _BLOCK, across * _BLOCK), -1)
    numbers[:rows, :columns] = np.arange(rows * columns).reshape(rows, columns)
    members = numbers.reshape(down, _BLOCK, across, _BLOCK).swapaxes(1, 2).reshape(down * across, -1)
    held = boxes.reshape(-1, 2, 3)[members]
    held[members < 0] = [[np.inf] * 3, [-np.inf] * 3]
    return np.stack([held[:, :, 0].min(axis=1), held[:, :, 1].max(axis=1)], axis=1), members


def tile_boxes(
    depths: NDArray[np.float64],
    window: Window,
    size: tuple[int, int],
    *,
    perspective: bool,
) -> NDArray[np.float64]:
    """(rows, columns, 2, 3) boxes in camera space of what an image of (width, height) shows in its tiles.

    depths: (rows, columns, 2) nearest and farthest planar depth; reversed where nothing is, which gives an empty box.
    window: left, right, bottom, top on the plane one unit ahead, or in scene units without perspective.
    """
    left, right, bottom, top = window
    x, y = (
        np.minimum(np.arange(n + 1) * TILE / length, 1.0) for n, length in zip(depths.shape[1::-1], size, strict=True)
    )
    x, y = left + x * (right - left), top - y * (top - bottom)
    near, far = depths[..., 0], depths[..., 1]
    empty = near > far
    edges = [(x[None, :-1], x[None, 1:]), (y[1:, None], y[:-1, None])]
    scales = (near, far) if perspective else (np.ones_like(near),) * 2
    sides = [
        (np.minimum(low * scales[0], low * scales[1]), np.maximum(high * scales[0], high * scales[1]))
        for low, high in edges
    ]
    boxes = np.stack([np.stack([*(side[i] for side in sides), (-far, -near)[i]], axis=-1) for i in range(2)], axis=-2)
    slack = ROUNDING * np.abs(boxes).max(axis=(2, 3), keepdims=True)
    boxes += slack * np.array([[-1.0], [1.0]])
    boxes[empty] = [[np.inf] * 3, [-np.inf] * 3]
    return boxes
