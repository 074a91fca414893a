"""Contact sheets: layers as labelled tiles of one picture, each with what its colours stand for."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import OpenImageIO as oiio

from defshade_cli.image.colour import Pixels
from defshade_cli.image.look import PANEL, Look
from defshade_cli.image.sizes import fitted

TILE = 480
"""Pixels: the greatest width of a tile."""

_GAP, _STRIP, _NAME = 8, 44, 24
_TEXT, _QUIET = (0.93, 0.93, 0.92), (0.62, 0.63, 0.65)


def contact_sheet(looks: Mapping[str, Look]) -> Pixels:
    """(H, W, 3) in [0, 1]: the layers, of one size, in rows, each over its name and its legend."""
    tiles = [_tile(name, look) for name, look in looks.items()]
    columns = min(len(tiles), math.ceil(math.sqrt(len(tiles) * 0.9)))
    height, width = tiles[0].shape[:2]
    rows = math.ceil(len(tiles) / columns)
    sheet = _panel(rows * (height + _GAP) + _GAP, columns * (width + _GAP) + _GAP)
    for index, tile in enumerate(tiles):
        top, left = (
            _GAP + place * (side + _GAP) for place, side in zip(divmod(index, columns), (height, width), strict=True)
        )
        sheet[top : top + height, left : left + width] = tile
    return sheet


def _tile(name: str, look: Look) -> Pixels:
    """The layer over a strip with its name and, to the right, its legend: beside the name alone where that has room."""
    image = fitted(look.colors, TILE)
    strip = _panel(_STRIP, image.shape[1])
    legend = look.legend
    if legend is not None and legend.shape[1] + 12 <= image.shape[1]:
        room = _NAME if legend.shape[0] < _NAME else _STRIP
        top = (room - legend.shape[0]) // 2
        strip[top : top + legend.shape[0], -legend.shape[1] - 6 : -6] = legend
    strip = _written(strip, 6, 18, name, 16, _TEXT)
    return np.concatenate([image, _written(strip, 6, 36, look.caption, 12, _QUIET)])


def _panel(height: int, width: int) -> Pixels:
    return np.full((height, width, 3), PANEL, np.float32)


def _written(image: Pixels, x: int, y: int, text: str, size: int, color: tuple[float, float, float]) -> Pixels:
    """The image with a line of text, its baseline at y."""
    buffer = oiio.ImageBuf(np.ascontiguousarray(image))
    oiio.ImageBufAlgo.render_text(buffer, x, y, text, size, "DroidSans", color)
    return np.asarray(buffer.get_pixels(oiio.FLOAT))
