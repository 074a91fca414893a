"""Skies of dome lights, from images."""

from __future__ import annotations

import logging
from functools import lru_cache
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.errors import OutputError
from defshade_cli.image.projections import latlong_from
from defshade_cli.image.transfer import linear
from defshade_cli.scene.environment import Environment, SkyLayout, uniform_environment
from defshade_cli.scene.light import DomeLight

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
    path = Path(light.texture)
    return _sky_in(path, light.layout, path.stat().st_mtime_ns if path.exists() else 0, light.path)


@lru_cache(maxsize=8)
def _sky_in(path: Path, layout: SkyLayout, _changed: int, light: str) -> Environment:
    """What the image of a light shows, which is said once where it cannot be read."""
    try:
        return read_environment(path, layout)
    except OutputError as error:
        log.warning("%s: %s; its sky is even", light, " ".join(str(error).split()))
        return _EVEN


def read_environment(path: Path, layout: SkyLayout = "automatic") -> Environment:
    """The sky in an image, scene-linear Rec. 709; 8-bit images count as sRGB.

    Read once as long as the file does not change. Raises OutputError where the file cannot be read.
    """
    try:
        return _read(str(path), layout, path.stat().st_mtime_ns)
    except OSError as error:
        raise OutputError(f"{path} cannot be read: {error.strerror}") from error


@lru_cache(maxsize=8)
def _read(path: str, layout: SkyLayout, _changed: int) -> Environment:
    image = oiio.ImageBuf(path)
    if image.has_error or not image.spec().nchannels:
        raise OutputError(f"{path} cannot be read: {image.geterror()}")
    is_display_referred = image.spec().format.basetype == oiio.UINT8
    if image.spec().width > _WIDEST:
        height = max(1, round(image.spec().height * _WIDEST / image.spec().width))
        image = oiio.ImageBufAlgo.resize(image, filtername="box", roi=oiio.ROI(0, _WIDEST, 0, height))
    pixels = _rgb(np.asarray(image.get_pixels(oiio.FLOAT)))
    pixels = np.where(np.isfinite(pixels), np.maximum(pixels, 0.0), 0.0)
    return Environment(latlong_from(linear(pixels) if is_display_referred else pixels, layout))


def _rgb(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Three channels: grey repeated, alpha dropped."""
    return np.repeat(pixels[..., :1], 3, axis=2) if pixels.shape[2] < 3 else pixels[..., :3]
