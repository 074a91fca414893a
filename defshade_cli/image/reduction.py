"""Images made smaller: by means of 2x2, as mip levels are made, and by resampling for what is left."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.image.transfer import linear


def reduced(pixels: NDArray[Any], side: int, *, srgb: bool) -> NDArray[Any]:
    """(H, W, C) with no side longer than `side`: by means of 2x2 as far as those go.

    srgb: bytes are sRGB-encoded, and light is what is averaged.
    """
    height, width = pixels.shape[:2]
    while max(height, width) >= 2 * side and height % 2 == width % 2 == 0:
        pixels = _halved_in_light(pixels) if srgb else _halved(pixels)
        height, width = pixels.shape[:2]
    scale = side / max(width, height)
    if scale >= 1.0:
        return pixels
    return resampled(pixels, max(1, round(width * scale)), max(1, round(height * scale)))


def resampled(pixels: NDArray[Any], width: int, height: int) -> NDArray[Any]:
    """(height, width, C), filtered as stored."""
    size = oiio.ROI(0, width, 0, height, 0, 1, 0, pixels.shape[2])
    kind = {"uint8": oiio.UINT8, "float16": oiio.HALF}.get(pixels.dtype.name, oiio.FLOAT)
    buffer = oiio.ImageBufAlgo.resize(oiio.ImageBuf(np.ascontiguousarray(pixels)), roi=size)
    return np.asarray(buffer.get_pixels(kind))


def _halved(pixels: NDArray[Any]) -> NDArray[Any]:
    """Means of 2x2 of (even, even, C); integers are rounded half up."""
    height, width, channels = pixels.shape
    halved = np.empty((height // 2, width // 2, channels), pixels.dtype)
    for channel in range(channels):  # NumPy is slow along axes as short as that of the channels
        halved[..., channel] = _mean(pixels[..., channel])
    return halved


def _halved_in_light(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The same of sRGB-encoded colours; alpha is not encoded."""
    halved = _halved(_light_of_codes(pixels))
    codes = np.empty(halved.shape, np.uint8)
    codes[..., :3] = _code_of_light()[halved[..., :3]]
    codes[..., 3:] = _halved(pixels[..., 3:])
    return codes


def _mean(plane: NDArray[Any]) -> NDArray[Any]:
    """(H / 2, W / 2) of (H, W)."""
    wide = {"uint8": np.uint16, "uint16": np.uint32}.get(plane.dtype.name, np.float32)
    rows = np.add(plane[0::2], plane[1::2], dtype=wide)
    sums = rows[:, 0::2] + rows[:, 1::2]
    return sums * np.float32(0.25) if wide is np.float32 else (sums + 2) >> 2


def _light_of_codes(codes: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """(H, W, C) 65535 for white, of an even number of codes: looked up in pairs, which takes half as long."""
    pairs = np.ascontiguousarray(codes).reshape(-1).view(np.uint16)
    return _light_of_pairs()[pairs].view(np.uint16).reshape(codes.shape)


@cache
def _light() -> NDArray[np.uint16]:
    """(256,) of each code of sRGB the light, 65535 for white."""
    return np.round(65535.0 * linear(np.arange(256) / 255.0)).astype(np.uint16)


@cache
def _light_of_pairs() -> NDArray[np.uint32]:
    """(65536,) of each two codes, as they lie in memory, their light likewise."""
    return _light()[np.arange(65536, dtype=np.uint16).view(np.uint8)].view(np.uint32)


@cache
def _code_of_light() -> NDArray[np.uint8]:
    """(65536,) of each such light the nearest code."""
    light = _light()
    edges = (light[1:].astype(np.uint32) + light[:-1] + 1) // 2
    return np.searchsorted(edges, np.arange(65536), "right").astype(np.uint8)
