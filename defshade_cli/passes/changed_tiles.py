"""The tiles of the image that must be drawn anew: those in which what changed is seen, or was."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.targets import NOWHERE, Part, pixels_of
from defshade_cli.passes.light_lists import TILE, tile_grid
from defshade_cli.passes.screen import Drawn, regions_of
from defshade_cli.plan import Plan
from defshade_cli.scene.geometry import box_corners
from defshade_cli.spaces import transform_points

Layers = dict[str, NDArray[np.float32]]

_ROUNDING = 2.0
"""Pixels around what is seen: what float32 and the raster's grid may move a corner, and more."""

_WORTHWHILE = 0.9
"""Share of the tiles from which on all are drawn."""


def changed_tiles(plan: Plan) -> NDArray[np.bool_] | None:
    """(R, C) rows and columns of TILE pixels a side; None where all of the image is drawn."""
    boxes = plan.redrawing.boxes
    if boxes is None:
        return None
    return worthwhile(_tiles_of(_rectangles(boxes, plan), plan.size))


def worthwhile(tiles: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """The same (R, C); None for so many that all of the image is drawn."""
    return tiles if tiles.mean() < _WORTHWHILE else None


def beside(before: Layers, layers: Layers, drawn: Drawn) -> Layers:
    """Layers (H, W, C) as drawn in some tiles, and as they were before in the others."""
    return {name: _joined(before[name], values, drawn) for name, values in layers.items()}


def _joined(before: NDArray[np.float32], values: NDArray[np.float32], drawn: Drawn) -> NDArray[np.float32]:
    height, width = values.shape[:2]
    joined = before.copy()
    for left, top, right, bottom in regions_of(drawn.tiles, drawn.side, (width, height)):
        x, y, across, down = pixels_of((left, top, right, bottom), (width, height))
        joined[y : y + down, x : x + across] = values[y : y + down, x : x + across]
    return joined


def part_around(tiles: NDArray[np.bool_], size: tuple[int, int]) -> Part:
    """Of an image of (width, height), around those of its tiles (R, C); nothing around none."""
    rows, columns = np.nonzero(tiles)
    if not len(rows):
        return NOWHERE
    corners = np.array([columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]) * TILE / np.array(size * 2)
    left, top, right, bottom = np.minimum(corners, 1.0).tolist()
    return left, top, right, bottom


def _rectangles(boxes: NDArray[np.float64], plan: Plan) -> NDArray[np.float64]:
    """(R, 4) left, top, right and bottom in pixels around where the camera sees boxes (N, 2, 3), those ahead of it."""
    camera, (width, height) = plan.camera, plan.size
    left, right, bottom, top = camera.window
    seen = transform_points(camera.camera_from_world, box_corners(boxes))
    depth = -seen[..., 2]
    scale = np.ones_like(depth)
    if camera.projection == "perspective":
        ahead = depth.max(axis=1) > 0.0
        seen, depth = seen[ahead], depth[ahead]
        scale = np.maximum(depth, 1e-30)
    pixels = np.array([width / (right - left), height / (top - bottom)])
    places = np.stack([seen[..., 0] / scale - left, top - seen[..., 1] / scale], axis=-1) * pixels
    blur = camera.lens_radius * np.abs(1.0 / (camera.focus_distance or np.inf) - 1.0 / scale)
    margin = blur.max(axis=1, initial=0.0)[:, None] * pixels + 0.5 * plan.filter_width + _ROUNDING
    found = np.hstack([places.min(axis=1) - margin, places.max(axis=1) + margin])
    found[depth.min(axis=1) <= 0.0] = 0.0, 0.0, width, height
    return found


def _tiles_of(rectangles: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.bool_]:
    """All that some rectangle meets: corners of each are counted up and down, and summed over the grid."""
    columns, rows = tile_grid(size)
    first = np.clip(np.floor(rectangles[:, :2] / TILE), 0, (columns, rows)).astype(int)
    last = np.clip(np.floor(rectangles[:, 2:] / TILE) + 1, 0, (columns, rows)).astype(int)
    counts = np.zeros((rows + 1, columns + 1), int)
    for y, x, step in ((first, first, 1), (first, last, -1), (last, first, -1), (last, last, 1)):
        np.add.at(counts, (y[:, 1], x[:, 0]), step)
    return counts.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0
