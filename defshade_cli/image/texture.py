"""Image files → texels that a GPU can hold.

What OpenImageIO opens is read: gray, gray with alpha, RGB and RGBA; CMYK and palettes as the RGB that it makes of them.
8-bit images stay 8-bit, sRGB-encoded where their colour space is; every other image becomes linear half floats.
Values are the file's own: alpha is multiplied into nothing.
"""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import PurePath
from typing import Any, NamedTuple

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.image.render_space import LINEAR_REC709
from defshade_cli.scene.texture import STATED_SPACES, ColorSpace, ImageFile, Wrap
from defshade_cli.spaces import Matrix

log = logging.getLogger("defshade")

LARGEST = 4096
"""Texels a side; larger images are reduced as they are read."""
BUDGET = 1 << 30
"""Bytes that all textures of a scene may take on the device, mip levels included; past it the largest are halved."""

_SMALLEST = 64
_MIPS = 4 / 3
_HALF_MAX = 65504.0
_WRAPS: dict[str, Wrap] = {"black": "black", "clamp": "clamp", "periodic": "repeat", "mirror": "mirror"}


class Source(NamedTuple):
    """A file and the colour space that it is read in."""

    file: ImageFile
    color_space: ColorSpace


oiio.attribute("limits:imagesize_MB", 8192)  # a header may claim anything; OpenImageIO's own limit is half the RAM


@dataclass(frozen=True, slots=True, eq=False)
class TexelImage:
    """texels: (H, W, C) uint8 or float16, row 0 at the bottom; C is 1 (r = g = b, a = 1) or 4.

    srgb: the colours of uint8 texels are sRGB-encoded.  wrap: what the file says of itself, s and t; else black.
    """

    texels: NDArray[Any]
    srgb: bool
    wrap: tuple[Wrap, Wrap] = ("black", "black")


@dataclass(frozen=True, slots=True)
class _Header:
    width: int
    height: int
    channels: int
    eight_bit: bool
    wrap: tuple[Wrap, Wrap]

    def bytes_at(self, side: float) -> float:
        """On the device, no side longer than `side`."""
        shrunk = min(1.0, side / max(self.width, self.height))
        texel = (1 if self.channels == 1 else 4) * (1 if self.eight_bit else 2)
        return self.width * self.height * shrunk * shrunk * texel * _MIPS


def load_images(sources: Mapping[Source, float]) -> dict[Source, TexelImage]:
    """Every image that can be read, of the texels a side that it is worth, within BUDGET.

    What cannot be read is logged and left out.
    """
    headers = {}
    for source in sources:
        try:
            headers[source] = _read_header(source.file)
        except OSError as error:
            log.warning("texture %s: %s", source.file.path, error)
    worth = {source: min(LARGEST, max(side, _SMALLEST)) for source, side in sources.items()}
    side = LARGEST
    while side > _SMALLEST and sum([h.bytes_at(min(side, worth[s])) for s, h in headers.items()]) > BUDGET:
        side //= 2
    images = {}
    for source, header in headers.items():
        try:
            images[source] = _read_image(source, header, int(min(side, worth[source])))
        except OSError as error:
            log.warning("texture %s: %s", source.file.path, error)
    return images


def resized(image: TexelImage, size: tuple[int, int]) -> TexelImage:
    """The image at (width, height), filtered as stored."""
    if image.texels.shape[1::-1] == size:
        return image
    return replace(image, texels=_resampled(image.texels, *size))


def world_to_screen(file: ImageFile) -> Matrix | None:
    """(4, 4): scene.texture.SeenFrom by the image's header. Raises OSError with the reason."""
    with _opened(file) as image:
        values = np.ravel(image.spec().getattribute("worldtoscreen") or ())
    return values.astype(np.float64).reshape(4, 4) if values.size == 16 and values.dtype.kind in "fi" else None


def _read_header(file: ImageFile) -> _Header:
    with _opened(file) as image:
        spec = image.spec()
        modes = str(spec.getattribute("wrapmodes") or "").split(",")
        wrap = _WRAPS.get(modes[0], "black"), _WRAPS.get(modes[-1], "black")
        return _Header(spec.width, spec.height, spec.nchannels, spec.format == oiio.UINT8, wrap)


def _read_image(source: Source, header: _Header, side: int) -> TexelImage:
    kind = oiio.UINT8 if header.eight_bit else oiio.FLOAT
    with _opened(source.file) as image:
        pixels = image.read_image(0, _level(image, side), 0, min(header.channels, 4), kind)
        if pixels is None:
            raise OSError(image.geterror())
    colored = header.channels >= 3
    srgb = source.color_space == "sRGB" or (source.color_space == "auto" and header.eight_bit and colored)
    if max(header.width, header.height) > side:
        log.info("texture %s: reduced to %d texels a side", source.file.path, side)
    if max(pixels.shape[:2]) > side:
        pixels = _reduced(pixels, side, srgb=srgb and header.eight_bit)
    texels = _four_channels(pixels) if colored or header.channels == 2 or srgb else pixels
    eight_bit = header.eight_bit
    if source.color_space not in STATED_SPACES:
        texels, eight_bit = _in_rec709(texels, source), False
    if not eight_bit:
        texels = _half(_linear(texels) if srgb else texels)
    return TexelImage(np.ascontiguousarray(texels[::-1]), srgb and eight_bit, header.wrap)


def _in_rec709(texels: NDArray[Any], source: Source) -> NDArray[np.float32]:
    """Colours of any space that the built-in OCIO config knows. Raises OSError for one that it does not."""
    scale = 255.0 if texels.dtype == np.uint8 else 1.0
    buffer = oiio.ImageBuf(np.ascontiguousarray(_four_channels(texels) / scale, np.float32))
    moved = oiio.ImageBufAlgo.colorconvert(buffer, source.color_space, LINEAR_REC709, unpremult=False)
    if moved.has_error:
        raise OSError(f"colour space {source.color_space}: {moved.geterror()}")
    return np.asarray(moved.get_pixels(oiio.FLOAT))


def _level(image: oiio.ImageInput, side: int) -> int:
    """Of a file that holds mip levels the smallest that is no smaller than `side`."""
    level = 0
    while image.seek_subimage(0, level + 1) and max(image.spec().width, image.spec().height) >= side:
        level += 1
    return level


def _reduced(pixels: NDArray[Any], side: int, *, srgb: bool) -> NDArray[Any]:
    """No side longer than `side`: by means of 2x2, as mip levels are made, as far as those go.

    srgb: bytes are sRGB-encoded, and light is what is averaged.
    """
    height, width = pixels.shape[:2]
    while max(height, width) >= 2 * side and height % 2 == width % 2 == 0:
        pixels = _halved_in_light(pixels) if srgb else _halved(pixels)
        height, width = pixels.shape[:2]
    scale = side / max(width, height)
    if scale >= 1.0:
        return pixels
    return _resampled(pixels, max(1, round(width * scale)), max(1, round(height * scale)))


def _halved(pixels: NDArray[Any]) -> NDArray[Any]:
    """Means of 2x2 of (even, even, C); integers are rounded half up."""
    wide = {"uint8": np.uint16, "uint16": np.uint32}.get(pixels.dtype.name, np.float32)
    rows = np.add(pixels[0::2], pixels[1::2], dtype=wide)
    sums = rows[:, 0::2] + rows[:, 1::2]
    return sums * np.float32(0.25) if wide is np.float32 else ((sums + 2) >> 2).astype(pixels.dtype)


def _halved_in_light(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The same of sRGB-encoded colours; alpha is not encoded."""
    color = _encoding()[_halved(_LIGHT[pixels[..., :3]])]
    return np.concatenate([color, _halved(pixels[..., 3:])], axis=2)


@cache
def _encoding() -> NDArray[np.uint8]:
    """(65536,) of each such light the nearest code."""
    edges = (_LIGHT[1:].astype(np.uint32) + _LIGHT[:-1] + 1) // 2
    return np.searchsorted(edges, np.arange(65536), "right").astype(np.uint8)


def _resampled(pixels: NDArray[Any], width: int, height: int) -> NDArray[Any]:
    size = oiio.ROI(0, width, 0, height, 0, 1, 0, pixels.shape[2])
    kind = {"uint8": oiio.UINT8, "float16": oiio.HALF}.get(pixels.dtype.name, oiio.FLOAT)
    buffer = oiio.ImageBufAlgo.resize(oiio.ImageBuf(np.ascontiguousarray(pixels)), roi=size)
    return np.asarray(buffer.get_pixels(kind))


def _four_channels(pixels: NDArray[Any]) -> NDArray[Any]:
    """As the UsdUVTexture schema says: one channel repeats, two are gray and alpha, a missing alpha is 1."""
    opaque = 255 if pixels.dtype == np.uint8 else 1
    channels = pixels.shape[2]
    color = pixels[..., :3] if channels >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    alpha = pixels[..., -1:] if channels in (2, 4) else np.full_like(pixels[..., :1], opaque)
    return np.concatenate([color, alpha], axis=2)


def _linear(texels: NDArray[Any]) -> NDArray[Any]:
    """sRGB's transfer curve undone on the colours: IEC 61966-2-1."""
    color = texels[..., :3]
    curved = ((np.maximum(color, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.concatenate([np.where(color <= 0.04045, color / 12.92, curved), texels[..., 3:]], axis=-1)


_LIGHT = np.round(65535.0 * _linear(np.arange(256)[:, None] / 255.0)[:, 0]).astype(np.uint16)
"""(256,) of each code of sRGB the light, 65535 for white."""


def _half(texels: NDArray[Any]) -> NDArray[np.float16]:
    return np.nan_to_num(texels, nan=0.0, posinf=_HALF_MAX).clip(-_HALF_MAX, _HALF_MAX).astype(np.float16)


@contextmanager
def _opened(file: ImageFile) -> Iterator[oiio.ImageInput]:
    """An open image. Raises OSError with the reason."""
    with _on_disk(file) as path:
        as_stored = oiio.ImageSpec()
        as_stored.attribute("oiio:UnassociatedAlpha", 1)
        image = oiio.ImageInput.open(path, as_stored)
        if image is None:
            raise OSError(oiio.geterror().strip().partition("\n")[0])
        try:
            yield image
        finally:
            image.close()


@contextmanager
def _on_disk(file: ImageFile) -> Iterator[str]:
    """A path that OpenImageIO opens; contents out of a package lie there for a while."""
    if file.contents is None:
        yield file.path
        return
    suffix = PurePath(file.path.rstrip("]")).suffix
    with tempfile.NamedTemporaryFile(suffix=suffix) as copy:
        copy.write(file.contents)
        copy.flush()
        yield copy.name
