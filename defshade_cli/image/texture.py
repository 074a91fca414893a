"""Image files → texels that a GPU can hold.

What OpenImageIO opens is read: gray, gray with alpha, RGB and RGBA; CMYK and palettes as the RGB that it makes of them.
8-bit images stay 8-bit, sRGB-encoded where their colour space is; every other image becomes linear half floats.
Values are the file's own: alpha is multiplied into nothing.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.image.packed import on_disk
from defshade_cli.image.reduction import reduced, resampled
from defshade_cli.image.render_space import LINEAR_REC709
from defshade_cli.image.transfer import linear
from defshade_cli.resources import core_count
from defshade_cli.scene.texture import STATED_SPACES, ColorSpace, ImageFile, Wrap
from defshade_cli.spaces import Matrix

_T = TypeVar("_T")

log = logging.getLogger("defshade")

LARGEST = 4096
"""Texels a side; larger images are reduced as they are read."""
BUDGET = 1 << 30
"""Bytes that all textures of a scene may take on the device, mip levels included; past it the largest are halved."""

_SMALLEST = 64
_MOST_AT_ONCE = 4
"""Images that are read at once, each of which takes its memory at full size for a while."""
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

    @property
    def bytes(self) -> float:
        """On the device."""
        return self.texels.nbytes * _MIPS


def load_images(sources: Mapping[Source, float]) -> dict[Source, TexelImage]:
    """Every image that can be read, of the texels a side that it is worth, within BUDGET.

    Each file is opened once, since some formats decode as they are opened. What cannot be read is logged and left out.
    """
    held = _Held()

    def read(source: Source) -> TexelImage:
        return _read_image(source, int(min(held.largest, max(sources[source], _SMALLEST))))

    for source, image in _each(read, sources):
        held.add(source, image)
    return held.images


class _Held:
    """Images within BUDGET. largest: texels a side, halved whenever one more would pass it."""

    def __init__(self) -> None:
        self.images: dict[Source, TexelImage] = {}
        self.largest = LARGEST
        self._bytes = 0.0

    def add(self, source: Source, image: TexelImage) -> None:
        self.images[source] = image = _no_larger(image, self.largest)
        self._bytes += image.bytes
        while self._bytes > BUDGET and self.largest > _SMALLEST:
            self.largest //= 2
            log.info("textures: reduced to %d texels a side, which their budget holds", self.largest)
            self.images = {source: _no_larger(image, self.largest) for source, image in self.images.items()}
            self._bytes = sum(image.bytes for image in self.images.values())


def _no_larger(image: TexelImage, side: int) -> TexelImage:
    if max(image.texels.shape[:2]) <= side:
        return image
    return replace(image, texels=reduced(image.texels, side, srgb=image.srgb))


def resized(image: TexelImage, size: tuple[int, int]) -> TexelImage:
    """The image at (width, height), filtered as stored."""
    if image.texels.shape[1::-1] == size:
        return image
    return replace(image, texels=resampled(image.texels, *size))


def world_to_screen(file: ImageFile) -> Matrix | None:
    """(4, 4): scene.texture.SeenFrom by the image's header. Raises OSError with the reason."""
    with opened(file) as image:
        values = np.ravel(image.spec().getattribute("worldtoscreen") or ())
    return values.astype(np.float64).reshape(4, 4) if values.size == 16 and values.dtype.kind in "fi" else None


def _each(read: Callable[[Source], _T], sources: Iterable[Source]) -> Iterator[tuple[Source, _T]]:
    """What `read` makes of each source, in order, some at a time: decoders and NumPy let other threads run.

    What cannot be read is logged and left out.
    """
    with ThreadPoolExecutor(min(_MOST_AT_ONCE, core_count())) as threads:
        reading = {source: threads.submit(read, source) for source in sources}
        for source, result in reading.items():
            try:
                yield source, result.result()
            except OSError as error:
                log.warning("texture %s: %s", source.file.path, error)


def _read_image(source: Source, side: int) -> TexelImage:
    with opened(source.file) as image:
        spec = image.spec()
        channels, eight_bit, wrap = spec.nchannels, spec.format == oiio.UINT8, _wraps(spec)
        if max(spec.width, spec.height) > side:
            log.info("texture %s: reduced to %d texels a side", source.file.path, side)
        kind = oiio.UINT8 if eight_bit else oiio.FLOAT
        pixels = image.read_image(0, _level(image, side), 0, min(channels, 4), kind)
        if pixels is None:
            raise OSError(image.geterror())
    srgb = source.color_space == "sRGB" or (source.color_space == "auto" and eight_bit and channels >= 3)
    if max(pixels.shape[:2]) > side:
        pixels = reduced(pixels, side, srgb=srgb and eight_bit)
    texels = _four_channels(pixels) if channels >= 2 or srgb else pixels
    if source.color_space not in STATED_SPACES:
        texels, eight_bit = _in_rec709(texels, source), False
    if not eight_bit:
        texels = _half(_in_light(texels) if srgb else texels)
    return TexelImage(texels[::-1], srgb and eight_bit, wrap)


def _wraps(spec: oiio.ImageSpec) -> tuple[Wrap, Wrap]:
    modes = str(spec.getattribute("wrapmodes") or "").split(",")
    return _WRAPS.get(modes[0], "black"), _WRAPS.get(modes[-1], "black")


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


def _four_channels(pixels: NDArray[Any]) -> NDArray[Any]:
    four = np.empty((*pixels.shape[:2], 4), pixels.dtype)
    for number, channel in enumerate("rgba"):
        place, one = place_of(channel, pixels.shape[2]), 255 if pixels.dtype == np.uint8 else 1
        four[..., number] = one if place is None else pixels[..., place]
    return four


def place_of(channel: str, channels: int) -> int | None:
    """Of r, g, b or a in a file of so many channels; None for an alpha that it lacks, which is 1.

    As the UsdUVTexture schema says: one channel repeats, two are gray and alpha.
    """
    if channel == "a":
        return channels - 1 if channels in (2, 4) else None
    return "rgb".index(channel) if channels >= 3 else 0


def _in_light(texels: NDArray[Any]) -> NDArray[Any]:
    """sRGB's curve undone on the colours."""
    return np.concatenate([linear(texels[..., :3]), texels[..., 3:]], axis=-1)


def _half(texels: NDArray[Any]) -> NDArray[np.float16]:
    return np.nan_to_num(texels, nan=0.0, posinf=_HALF_MAX).clip(-_HALF_MAX, _HALF_MAX).astype(np.float16)


@contextmanager
def opened(file: ImageFile) -> Iterator[oiio.ImageInput]:
    """An open image. Raises OSError with the reason."""
    with on_disk(file) as path:
        as_stored = oiio.ImageSpec()
        as_stored.attribute("oiio:UnassociatedAlpha", 1)
        image = oiio.ImageInput.open(path, as_stored)
        if image is None:
            raise OSError(oiio.geterror().strip().partition("\n")[0])
        try:
            yield image
        finally:
            image.close()
