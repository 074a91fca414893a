"""Skies of dome lights, from images."""

from __future__ import annotations

import logging
from functools import lru_cache

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.image.packed import on_disk, stamp
from defshade_cli.image.projections import latlong_from
from defshade_cli.image.transfer import linear
from defshade_cli.scene.environment import Environment, SkyLayout, uniform_environment
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.texture import ImageFile

log = logging.getLogger("defshade")

_EVEN = uniform_environment()
_WIDEST = 4096
"""Columns; a wider image is reduced when it is read."""


def sky_of(light: DomeLight) -> Environment:
    """The dome's sky; an even one, with a warning, where its image cannot be read."""
    if light.environment:
        return light.environment
    if not light.texture:
        return _EVEN
    return _sky_in(light.texture, light.layout, stamp(light.texture), light.path)


@lru_cache(maxsize=8)
def _sky_in(file: ImageFile, layout: SkyLayout, version: int, light: str) -> Environment:
    """What the image of a light shows, which is said once where it cannot be read."""
    try:
        return _read(file, layout, version)
    except OSError as error:
        log.warning("%s: %s cannot be read: %s; its sky is even", light, file.path, " ".join(str(error).split()))
        return _EVEN


@lru_cache(maxsize=8)
def _read(file: ImageFile, layout: SkyLayout, _version: int) -> Environment:
    """The sky in an image, scene-linear Rec. 709; 8-bit images count as sRGB.

    Read once as long as the file does not change. Raises OSError where it cannot be read.
    """
    with on_disk(file) as path:
        pixels, is_display_referred = _pixels(path)
    pixels = np.where(np.isfinite(pixels), np.maximum(pixels, 0.0), 0.0)
    return Environment(latlong_from(linear(pixels) if is_display_referred else pixels, layout))


def _pixels(path: str) -> tuple[NDArray[np.float32], bool]:
    """(H, W, 3) no wider than _WIDEST, and whether they are for displays. Raises OSError."""
    image = oiio.ImageBuf(path)
    if image.has_error or not image.spec().nchannels:
        raise OSError(image.geterror())
    is_display_referred = image.spec().format.basetype == oiio.UINT8
    if image.spec().width > _WIDEST:
        height = max(1, round(image.spec().height * _WIDEST / image.spec().width))
        image = oiio.ImageBufAlgo.resize(image, filtername="box", roi=oiio.ROI(0, _WIDEST, 0, height))
    return _rgb(np.asarray(image.get_pixels(oiio.FLOAT))), is_display_referred


def _rgb(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Three channels: grey repeated, alpha dropped."""
    return np.repeat(pixels[..., :1], 3, axis=2) if pixels.shape[2] < 3 else pixels[..., :3]
