"""Contact sheets: every layer of a film as a labelled tile of one picture, data in false colour with a legend."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.image.colour import DisplayTransform, Pixels, picture
from defshade_cli.image.false_colour import colors_of_ids
from defshade_cli.image.film import Film
from defshade_cli.image.layers import ID, SCENE_UNITS, UNIT_VECTOR, Layer

TILE = 480
"""Pixels: the greatest width of a tile."""

_GAP, _STRIP, _LEGEND = 8, 44, 40
_PANEL, _TEXT, _QUIET = (0.105, 0.11, 0.12), (0.93, 0.93, 0.92), (0.62, 0.63, 0.65)
_RAMP = "viridis"  # even steps of lightness: near is bright


def contact_sheet(film: Film, names: tuple[str, ...], transform: DisplayTransform) -> Pixels:
    """(H, W, 3) in [0, 1]: the layers in rows, each over its name and what its colours stand for."""
    tiles = [_tile(film, name, transform) for name in names]
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


def _tile(film: Film, name: str, transform: DisplayTransform) -> Pixels:
    """The layer over a strip with its name and, to the right, its legend."""
    row, pixels = film.row(name), film.layers[name]
    image = _scaled(np.broadcast_to(_colors(film, name, row, transform), (*pixels.shape[:2], 3)))
    strip = _panel(_STRIP, image.shape[1])
    caption, legend = _legend(film, row, pixels)
    if legend is not None and legend.shape[1] + 12 <= image.shape[1]:
        middle = (_STRIP - legend.shape[0]) // 2
        strip[middle : middle + legend.shape[0], -legend.shape[1] - 6 : -6] = legend
    strip = _written(strip, 6, 18, name, 16, _TEXT)
    return np.concatenate([image, _written(strip, 6, 36, caption, 12, _QUIET)])


def _colors(film: Film, name: str, row: Layer, transform: DisplayTransform) -> Pixels:
    pixels = film.layers[name]
    if row.unit == SCENE_UNITS and len(row.channels) == 1:
        return _ramp(_nearness(pixels)) * np.isfinite(pixels)
    shown = film.shown.get((name, True))
    shown = picture(row, pixels, transform, alpha=True) if shown is None else np.asarray(shown, np.float32)
    if row.unit == UNIT_VECTOR:
        return shown * pixels.any(axis=-1, keepdims=True)
    return shown[..., :3] * shown[..., 3:] if shown.shape[-1] == 4 else shown


def _legend(film: Film, row: Layer, pixels: Pixels) -> tuple[str, Pixels | None]:
    """What the colours mean, in words and, where words do not do, as a picture."""
    if row.unit == SCENE_UNITS and len(row.channels) == 1:
        near, far = _range(pixels)
        return f"{near:.4g} to {far:.4g} {row.unit}, near is bright", _bar()
    if row.unit == UNIT_VECTOR:
        return f"{row.unit}, {row.space} space: x red, y green, z blue", _ball()
    if row.unit == ID:
        return _ids(film, row, pixels)
    if row.source == "motion":
        return f"{np.abs(pixels).max(initial=0.0):.3g} {row.unit} at full colour", _disc(lambda x, y: (x, y, 0 * x))
    return row.summary, None


def _ids(film: Film, row: Layer, pixels: Pixels) -> tuple[str, Pixels | None]:
    """How many there are; the colours and names of those that cover most."""
    found, counts = np.unique(pixels[pixels != row.background], return_counts=True)
    largest = found[np.argsort(-counts)][:4].astype(np.int64)
    known = film.manifests.get(row.name, {})
    names = ", ".join(known.get(int(number), str(number)).rpartition("/")[2] for number in largest)
    swatches = np.repeat(np.repeat(colors_of_ids(largest.astype(np.uint32))[None], 16, axis=0), 18, axis=1)
    return f"{len(found)}: {names}" + (" …" if len(found) > len(largest) else ""), swatches if len(largest) else None


def _nearness(pixels: Pixels) -> Pixels:
    near, far = _range(pixels)
    return np.nan_to_num(1.0 - (pixels - near) / ((far - near) or 1.0), nan=0.0, neginf=0.0)


def _range(pixels: Pixels) -> tuple[float, float]:
    finite = pixels[np.isfinite(pixels)]
    return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)


def _ramp(values: Pixels) -> Pixels:
    """(H, W, 1) in [0, 1] → (H, W, 3), encoded for a display; OpenImageIO's maps are linear."""
    buffer = oiio.ImageBuf(np.ascontiguousarray(values, np.float32))
    linear = np.asarray(oiio.ImageBufAlgo.color_map(buffer, 0, _RAMP).get_pixels(oiio.FLOAT))[..., :3]
    return np.clip(linear, 0.0, 1.0) ** np.float32(1 / 2.2)


def _bar() -> Pixels:
    return np.repeat(_ramp(np.linspace(1.0, 0.0, 96, dtype=np.float32)[None, :, None]), 14, axis=0)


def _ball() -> Pixels:
    """A ball with the colours that its normals have: x to the right, y up, z towards the eye."""
    return _disc(lambda x, y: (x, y, np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))))


def _disc(vector: Callable[[NDArray, NDArray], tuple[NDArray, NDArray, NDArray]]) -> Pixels:
    axis = (np.arange(_LEGEND, dtype=np.float32) + 0.5) * (2.0 / _LEGEND) - 1.0
    x, y = np.meshgrid(axis, -axis)
    colors = 0.5 + 0.5 * np.stack(vector(x, y), axis=-1)
    cover = np.clip((1.0 - np.hypot(x, y)) * _LEGEND / 2, 0.0, 1.0)[..., None]
    return (colors * cover + np.array(_PANEL) * (1.0 - cover)).astype(np.float32)


def _scaled(image: Pixels) -> Pixels:
    height, width = image.shape[:2]
    if width <= TILE:
        return np.array(image, np.float32)
    roi = oiio.ROI(0, TILE, 0, max(1, round(height * TILE / width)), 0, 1, 0, 3)
    smaller = oiio.ImageBufAlgo.resize(oiio.ImageBuf(np.ascontiguousarray(image, np.float32)), "triangle", 0.0, roi)
    return np.clip(np.asarray(smaller.get_pixels(oiio.FLOAT)), 0.0, 1.0)


def _panel(height: int, width: int) -> Pixels:
    return np.full((height, width, 3), _PANEL, np.float32)


def _written(image: Pixels, x: int, y: int, text: str, size: int, color: tuple[float, float, float]) -> Pixels:
    """The image with a line of text, its baseline at y."""
    buffer = oiio.ImageBuf(np.ascontiguousarray(image))
    oiio.ImageBufAlgo.render_text(buffer, x, y, text, size, "DroidSans", color)
    return np.asarray(buffer.get_pixels(oiio.FLOAT))
