"""Pictures to look at: display-referred, one layer a file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.image.colour import Pixels, display_transform, picture
from defshade_cli.image.encoders.sink import bounded, make_spec, opened, set_attributes
from defshade_cli.image.film import Film
from defshade_cli.image.metadata import text_attributes
from defshade_cli.settings import OutputSettings

Hint = tuple[str, str | int]

_DITHER_SEED = 1  # equal films, equal files


_SRGB = "sRGB - Display"

_UP = 0x20
"""libpng's PNG_FILTER_UP: one filter for all rows takes half the time of trying each, for files as small."""


@dataclass(frozen=True, slots=True)
class PictureFormat:
    """bits: a channel, the default first.  hints: attributes for the encoder.

    implied: the colour space that the encoder writes for one that is not named. For a name it loads a whole config.
    fails_badly: on a full disk the encoder ends the process (libjpeg) or never returns (libwebp), so the space is
        claimed beforehand.
    """

    bits: tuple[int, ...] = (8,)
    alpha: bool = True
    hints: tuple[Hint, ...] = ()
    implied: str = ""
    fails_badly: bool = False


_JPEG = PictureFormat(alpha=False, hints=(("compression", "jpeg:95"), ("jpeg:subsampling", "4:4:4")), fails_badly=True)
_TIFF = PictureFormat((16, 8), hints=(("compression", "zip"), ("Exif:ColorSpace", 65535)))
"""Uncalibrated, unless the display is sRGB: an Exif block without any entry is reported as a failure."""

PICTURES = {
    ".png": PictureFormat((8, 16), hints=(("png:compressionLevel", 1), ("png:filter", _UP)), implied=_SRGB),
    ".jpg": _JPEG,
    ".jpeg": _JPEG,
    ".jxl": PictureFormat((8, 16), hints=(("compression", "jpegxl:100"),)),
    ".tif": _TIFF,
    ".tiff": _TIFF,
    ".webp": PictureFormat(hints=(("compression", "lossless"),), fails_badly=True),
    ".tga": PictureFormat(),
    ".bmp": PictureFormat(alpha=False),
    ".ppm": PictureFormat(alpha=False, hints=(("pnm:pfmflip", 0),)),  # else OpenImageIO writes it upside down
}


def write_picture(film: Film, name: str, output: OutputSettings, path: Path) -> None:
    """Write the layer `name` as it looks. Raises OSError with the reason, UsageError for no such display or view."""
    form, layer = _format(path), film.row(name)
    transform = display_transform(output.display, output.view, output.look, film.render_space)
    shown = film.shown.get((name, form.alpha))
    if shown is None:
        pixels = bounded(name, film.layers[name], half=layer.is_color)
        shown = picture(layer, pixels, transform, alpha=form.alpha)
    bits = bits_of(path, output)
    spec = make_spec(film, shown.shape[-1], f"uint{bits}")
    if layer.is_color and transform.encoding != form.implied:
        spec.set_colorspace(transform.encoding)
    _write(shown, spec, film, path, dithered=output.dither and layer.is_color and bits == 8)


def write_sheet(film: Film, names: tuple[str, ...], output: OutputSettings, path: Path) -> None:
    """Write all the layers as tiles of one picture. Raises as `write_picture`: OSError, UsageError."""
    from defshade_cli.image.look import look_at_film
    from defshade_cli.image.sheet import contact_sheet

    transform = display_transform(output.display, output.view, output.look, film.render_space)
    sheet = contact_sheet({name: look_at_film(film, name, transform) for name in names})
    height, width = sheet.shape[:2]
    _write(sheet, oiio.ImageSpec(width, height, 3, f"uint{bits_of(path, output)}"), film, path)


def bits_of(path: Path, output: OutputSettings) -> int:
    """A channel of the picture: those asked for, or the format's default."""
    return output.bits or _format(path).bits[0]


def _format(path: Path) -> PictureFormat:
    return PICTURES[path.suffix.lower()]


def _write(
    shown: Pixels | NDArray[np.uint8], spec: oiio.ImageSpec, film: Film, path: Path, *, dithered: bool = False
) -> None:
    form = _format(path)
    for hint, value in (*form.hints, *_hints(dithered=dithered)):
        spec.attribute(hint, value)
    set_attributes(spec, text_attributes(film))
    if form.fails_badly:
        _claim(path, spec.image_bytes())
    with opened(path, [spec]) as encoder:
        encoder.write_image(np.ascontiguousarray(shown))


def _hints(*, dithered: bool) -> Iterator[Hint]:
    yield "oiio:UnassociatedAlpha", 1
    if dithered:
        yield "oiio:dither", _DITHER_SEED


def _claim(path: Path, size: int) -> None:
    with path.open("wb") as file:
        os.posix_fallocate(file.fileno(), 0, size + 2**16)
