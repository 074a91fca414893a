"""Layers for eyes: colours in place of data, and what they stand for in words and as a legend."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.image.colour import DisplayTransform, Pixels, picture
from defshade_cli.image.false_colour import colors_of_ids
from defshade_cli.image.film import Film
from defshade_cli.image.layers import AS_STORED, ID, SCENE_UNITS, UNIT_VECTOR, Layer

PANEL = (0.105, 0.11, 0.12)
"""The colour around pictures and legends."""

_LEGEND = 40
_RAMP = "viridis"  # even steps of lightness: near is bright


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One layer as it is shown.

    colors: (H, W, 3) in [0, 1], encoded for the display.
    caption: what they stand for.  legend: the same as a picture (h, w, 3), where words do not do.
    """

    colors: Pixels
    caption: str
    legend: Pixels | None


def look_at_film(film: Film, name: str, transform: DisplayTransform) -> Look:
    """The film's layer `name`; what a display transform was applied to already is taken as it is."""
    row, pixels = film.row(name), film.layers[name]
    return look_at(row, pixels, transform, names=film.manifests.get(row.name, {}), shown=film.shown.get((name, True)))


def look_at(
    row: Layer,
    pixels: Pixels,
    transform: DisplayTransform,
    *,
    names: Mapping[int, str],
    shown: NDArray[np.float32] | NDArray[np.uint8] | None = None,
) -> Look:
    """The layer (H, W, C) that `row` describes.

    names: what ids stand for.  shown: the same after the display transform, alpha straight, where that is known.
    """
    colors = np.broadcast_to(_colors(row, pixels, transform, shown), (*pixels.shape[:2], 3))
    return Look(colors, *_legend(row, pixels, names))


def _colors(
    row: Layer, pixels: Pixels, transform: DisplayTransform, shown: NDArray[np.float32] | NDArray[np.uint8] | None
) -> Pixels:
    if _is_range(row):
        nearness = _nearness(pixels)
        return _ramp(nearness if row.unit == SCENE_UNITS else 1.0 - nearness) * np.isfinite(pixels)
    colors = picture(row, pixels, transform, alpha=True) if shown is None else np.asarray(shown, np.float32)
    if row.unit == UNIT_VECTOR:
        return colors * pixels.any(axis=-1, keepdims=True)
    return colors[..., :3] * colors[..., 3:] if colors.shape[-1] == 4 else colors[..., :3]


def _legend(row: Layer, pixels: Pixels, names: Mapping[int, str]) -> tuple[str, Pixels | None]:
    if _is_range(row):
        near, far = _range(pixels)
        return f"{near:.4g} to {far:.4g} {row.unit}, {'near' if row.unit == SCENE_UNITS else 'more'} is bright", _bar()
    if row.unit == UNIT_VECTOR:
        return f"{row.unit}, {row.space} space: x red, y green, z blue", _ball()
    if row.unit == ID:
        return _ids(row, pixels, names)
    if row.source == "motion":
        return f"{np.abs(pixels).max(initial=0.0):.3g} {row.unit} at full colour", _disc(lambda x, y: (x, y, 0 * x))
    return row.summary, None


def _is_range(row: Layer) -> bool:
    return row.unit in (SCENE_UNITS, AS_STORED) and len(row.channels) == 1


def _ids(row: Layer, pixels: Pixels, names: Mapping[int, str]) -> tuple[str, Pixels | None]:
    """How many there are; the colours and names of those that cover most."""
    found, counts = np.unique(pixels[pixels != row.background], return_counts=True)
    largest = found[np.argsort(-counts)][:4].astype(np.int64)
    known = ", ".join(names.get(int(number), str(number)).rpartition("/")[2] for number in largest)
    swatches = np.repeat(np.repeat(colors_of_ids(largest.astype(np.uint32))[None], 16, axis=0), 18, axis=1)
    return f"{len(found)}: {known}" + (" …" if len(found) > len(largest) else ""), swatches if len(largest) else None


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


def _disc(vector: Callable[[NDArray[Any], NDArray[Any]], tuple[NDArray[Any], NDArray[Any], NDArray[Any]]]) -> Pixels:
    axis = (np.arange(_LEGEND, dtype=np.float32) + 0.5) * (2.0 / _LEGEND) - 1.0
    x, y = np.meshgrid(axis, -axis)
    colors = 0.5 + 0.5 * np.stack(vector(x, y), axis=-1)
    cover = np.clip((1.0 - np.hypot(x, y)) * _LEGEND / 2, 0.0, 1.0)[..., None]
    return (colors * cover + np.array(PANEL) * (1.0 - cover)).astype(np.float32)
