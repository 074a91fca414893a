"""OpenEXR: scene-linear layers in one part or a part each, in scanlines or tiles, with mip levels when asked."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from defshade_cli.dataclass import dataclass
from defshade_cli.image.colour import Pixels
from defshade_cli.image.encoders.sink import bounded, make_spec, opened, set_attributes
from defshade_cli.image.film import Film
from defshade_cli.image.layers import BEAUTY, MAIN_PART
from defshade_cli.image.metadata import exr_attributes
from defshade_cli.image.render_space import LINEAR_REC709
from defshade_cli.settings import Compression, OutputSettings

_DATA = "data"
_INTEROP_IDS = (LINEAR_REC709, _DATA)
"""Names of spaces that are their ids too. Where a header is given no id, OpenImageIO loads a config to look for it."""

TILE = 64
"""Texels a side of a tile, as maketx has it."""

_BAND = 128
"""Rows interleaved at a time: a few blocks of every EXR compression, and no second copy of a large film."""

_DWA_LOSSY = {"R", "G", "B", "Y"}
"""Channel names that DWA compression blurs, 32-bit ones too: OpenEXR, ImfDwaCompressor.cpp, the channel rules."""

log = logging.getLogger("defshade")


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """Layers that share one part of the file, and which of them are kept in half."""

    spec: oiio.ImageSpec
    planes: tuple[Pixels, ...]
    halves: bool

    @property
    def dtype(self) -> type:
        return np.float16 if self.halves else np.float32

    def rows(self, top: int, bottom: int) -> Pixels:
        """(rows, W, C) of the layers side by side."""
        bands = [plane[top:bottom] for plane in self.planes]
        return np.ascontiguousarray(np.concatenate(bands, axis=-1, dtype=self.dtype, casting="same_kind"))


def write_exr(film: Film, names: tuple[str, ...], output: OutputSettings, path: Path) -> None:
    """Write the layers `names`. Raises OSError with the reason."""
    groups = [(name,) for name in names] if output.multipart else [names]
    parts = [_part(film, group, output) for group in groups]
    with opened(path, [part.spec for part in parts]) as encoder:
        for index, part in enumerate(parts):
            if index > 0:
                encoder.open(str(path), part.spec, "AppendSubimage")
            _write_part(encoder, part, path, mipmaps=output.mipmaps)


def _part(film: Film, names: tuple[str, ...], output: OutputSettings) -> _Part:
    halves = {name for name in names if film.row(name).is_color and not output.full_float}
    planes = tuple(bounded(name, film.layers[name], half=name in halves) for name in names)
    spec = _spec(film, names, halves, output.compression)
    if output.multipart:
        row = film.row(names[0])
        spec.attribute("oiio:subimagename", MAIN_PART if row.name == BEAUTY else row.exr_name)
    if output.tiled or output.mipmaps:
        spec.tile_width = spec.tile_height = TILE
    if output.mipmaps:
        spec.attribute("textureformat", "Plain Texture")  # OpenImageIO's name for a file with mip levels
    return _Part(spec, planes, len(halves) == len(names))


def _spec(film: Film, names: tuple[str, ...], halves: set[str], compression: Compression) -> oiio.ImageSpec:
    channels = [channel for name in names for channel in film.row(name).channel_names]
    types = ["half" if name in halves else "float" for name in names for _ in film.row(name).channels]
    spec = make_spec(film, len(channels), types[0])
    spec.channelnames = channels
    if len(set(types)) > 1:
        spec.channelformats = tuple(oiio.TypeDesc(kind) for kind in types)
    space = film.render_space.interop_id if any(film.row(name).is_color for name in names) else _DATA
    spec.set_colorspace(space)
    if space in _INTEROP_IDS:
        spec.attribute("colorInteropID", space)
    spec.attribute("compression", _lossless_for_data(compression, film, names))
    set_attributes(spec, exr_attributes(film, names))
    return spec


def _lossless_for_data(compression: Compression, film: Film, names: tuple[str, ...]) -> Compression:
    data = [name for name in names if not film.row(name).is_color and _DWA_LOSSY & film.row(name).suffixes]
    if compression != "dwaa" or not data:
        return compression
    log.warning("dwaa would blur the data in %s: this file is compressed with zip", ", ".join(data))
    return "zip"


def _write_part(encoder: oiio.ImageOutput, part: _Part, path: Path, *, mipmaps: bool) -> None:
    if part.spec.tile_width == 0:
        for top in range(0, part.spec.height, _BAND):
            bottom = min(top + _BAND, part.spec.height)
            encoder.write_scanlines(part.spec.y + top, part.spec.y + bottom, 0, part.rows(top, bottom))
        return
    for level, pixels in enumerate(_levels(part.rows(0, part.spec.height), mipmaps=mipmaps)):
        if level > 0:
            encoder.open(str(path), _level_spec(part.spec, pixels), "AppendMIPLevel")
        encoder.write_image(pixels)


def _levels(pixels: Pixels, *, mipmaps: bool) -> Iterator[Pixels]:
    """The image, and with `mipmaps` each level down to one pixel: means of 2x2, an odd last row or column left out."""
    yield pixels
    while mipmaps and max(pixels.shape[:2]) > 1:
        pixels = _halved(_halved(pixels, 0), 1)
        yield np.ascontiguousarray(pixels)


def _halved(pixels: Pixels, axis: int) -> Pixels:
    """Means of neighbours along an axis; a single row or column stays."""
    pairs = pixels.shape[axis] // 2
    if pairs == 0:
        return pixels
    even, odd = (pixels.take(range(first, 2 * pairs, 2), axis).astype(np.float32) for first in (0, 1))
    return (0.5 * (even + odd)).astype(pixels.dtype)


def _level_spec(spec: oiio.ImageSpec, pixels: Pixels) -> oiio.ImageSpec:
    level = oiio.ImageSpec(spec)
    level.height, level.width = pixels.shape[:2]
    level.full_height, level.full_width = pixels.shape[:2]
    return level
