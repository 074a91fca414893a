"""Encoders: what each file format holds of a film, and how OpenImageIO is asked to write it."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from defshade_cli.errors import UsageError
from defshade_cli.image.colour import BRIGHTEST, RENDER_SPACE, Pixels, display_space, picture
from defshade_cli.image.film import Film
from defshade_cli.image.layers import LAYERS
from defshade_cli.image.metadata import Attribute, exr_attributes, text_attributes
from defshade_cli.settings import OutputSettings

EXR = ".exr"
_BAND = 128
"""Rows interleaved at a time: a few blocks of every EXR compression, and no second copy of a large film."""

_DWA_LOSSY = {"R", "G", "B", "Y"}
"""Channel names that DWA compression blurs, 32-bit ones too: OpenEXR, ImfDwaCompressor.cpp, the channel rules."""

log = logging.getLogger("defshade")


@dataclass(frozen=True, slots=True)
class _PictureFormat:
    """channel: OpenImageIO's channel type.  hints: attributes for the encoder.

    fails_badly: on a full disk the encoder ends the process (libjpeg) or never returns (libwebp), so the space is
        claimed beforehand.
    """

    channel: str = "uint8"
    alpha: bool = True
    hints: tuple[tuple[str, str | int], ...] = ()
    fails_badly: bool = False


_JPEG = _PictureFormat(alpha=False, hints=(("compression", "jpeg:95"), ("jpeg:subsampling", "4:4:4")), fails_badly=True)
_TIFF = _PictureFormat("uint16", hints=(("compression", "zip"), ("Exif:ColorSpace", 65535)))
"""Uncalibrated, unless the display is sRGB: an Exif block without any entry is reported as a failure."""

_PICTURES = {
    ".png": _PictureFormat(hints=(("png:compressionLevel", 1),)),
    ".jpg": _JPEG,
    ".jpeg": _JPEG,
    ".tif": _TIFF,
    ".tiff": _TIFF,
    ".webp": _PictureFormat(hints=(("compression", "lossless"),), fails_badly=True),
    ".tga": _PictureFormat(),
    ".bmp": _PictureFormat(alpha=False),
    ".ppm": _PictureFormat(alpha=False, hints=(("pnm:pfmflip", 0),)),  # else OpenImageIO writes it upside down
}
SUFFIXES = (EXR, *_PICTURES)


def suffix_of(path: Path) -> str:
    """The suffix in lower case. Raises UsageError for one that no encoder has."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise UsageError(f"'{path}': no format for the suffix '{path.suffix}'; write {', '.join(SUFFIXES)}")
    return suffix


def encode(film: Film, names: tuple[str, ...], output: OutputSettings, path: Path) -> None:
    """Write layers to `path`: all as EXR, the only one as a picture. Raises OSError with the reason."""
    if suffix_of(path) == EXR:
        _write_exr(film, names, output, path)
    else:
        (name,) = names
        _write_picture(film, name, output, path)


def _write_exr(film: Film, names: tuple[str, ...], output: OutputSettings, path: Path) -> None:
    halves = {name for name in names if LAYERS[name].is_color and not output.full_float}
    planes = [_bounded(name, film.layers[name], BRIGHTEST if name in halves else None) for name in names]
    spec = _exr_spec(film, names, halves, output.compression)
    band_type = np.float16 if len(halves) == len(names) else np.float32
    with _encoder(path, spec) as encoder:
        for top in range(0, spec.height, _BAND):
            bottom = min(top + _BAND, spec.height)
            rows = [plane[top:bottom] for plane in planes]
            band = np.concatenate(rows, axis=-1, dtype=band_type, casting="same_kind")
            encoder.write_scanlines(top, bottom, 0, np.ascontiguousarray(band))


def _exr_spec(film: Film, names: tuple[str, ...], halves: set[str], compression: str) -> oiio.ImageSpec:
    channels = [channel for name in names for channel in LAYERS[name].channel_names]
    types = ["half" if name in halves else "float" for name in names for _ in LAYERS[name].channels]
    spec = oiio.ImageSpec(*film.size, len(channels), types[0])
    spec.channelnames = channels
    if len(set(types)) > 1:
        spec.channelformats = tuple(oiio.TypeDesc(kind) for kind in types)
    spec.set_colorspace(RENDER_SPACE if any(LAYERS[name].is_color for name in names) else "data")
    spec.attribute("compression", _lossless_for_data(compression, names))
    _set(spec, exr_attributes(film, names))
    return spec


def _lossless_for_data(compression: str, names: tuple[str, ...]) -> str:
    data = [name for name in names if not LAYERS[name].is_color and _DWA_LOSSY & set(LAYERS[name].channels)]
    if compression != "dwaa" or not data:
        return compression
    log.warning("dwaa would blur the data in %s: this file is compressed with zip", ", ".join(data))
    return "zip"


def _write_picture(film: Film, name: str, output: OutputSettings, path: Path) -> None:
    form, layer = _PICTURES[suffix_of(path)], LAYERS[name]
    pixels = _bounded(name, film.layers[name], BRIGHTEST if layer.is_color else None)
    shown = picture(layer, pixels, alpha=form.alpha, display=output.display, view=output.view)
    spec = oiio.ImageSpec(*film.size, shown.shape[-1], form.channel)
    if layer.is_color:
        spec.set_colorspace(display_space(output.display, output.view))
    spec.attribute("oiio:UnassociatedAlpha", 1)
    for hint, value in form.hints:
        spec.attribute(hint, value)
    _set(spec, text_attributes(film))
    if form.fails_badly:
        _claim(path, spec.image_bytes())
    with _encoder(path, spec) as encoder:
        encoder.write_image(np.ascontiguousarray(shown))


def _bounded(name: str, pixels: Pixels, limit: float | None) -> Pixels:
    """The pixels, brought within ±limit; what is wrong with them goes to the log."""
    low, high = pixels.min(), pixels.max()
    if np.isnan(low):
        log.warning("%s: %d values are NaN", name, np.count_nonzero(np.isnan(pixels)))
    if limit is None or (low >= -limit and high <= limit):
        return pixels
    if beyond := np.count_nonzero(np.abs(pixels) > limit):
        log.warning("%s: %d values beyond half's %g are clamped", name, beyond, limit)
    return np.clip(pixels, -limit, limit)


def _claim(path: Path, size: int) -> None:
    with path.open("wb") as file:
        os.posix_fallocate(file.fileno(), 0, size + 2**16)


@contextmanager
def _encoder(path: Path, spec: oiio.ImageSpec) -> Iterator[oiio.ImageOutput]:
    """An open encoder. Some report a failure through the message alone, so that is asked at the end."""
    encoder = oiio.ImageOutput.create(str(path))
    if encoder is None:
        raise OSError(oiio.geterror())
    if encoder.open(str(path), spec):
        yield encoder
        encoder.close()
    if reason := encoder.geterror():
        raise OSError(reason)


def _set(spec: oiio.ImageSpec, attributes: Iterable[Attribute]) -> None:
    for name, kind, value in attributes:
        spec.attribute(name, oiio.TypeDesc(kind), value)
