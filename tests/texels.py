"""Images to make textures of."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.image.texture import Source, TexelImage, load_images
from defshade_cli.scene.texture import ImageFile

SIDE = 16


def save(path: Path, pixels: NDArray, **attributes: str) -> ImageFile:
    """`pixels`, row 0 at the top, in their own type."""
    kind = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}[pixels.dtype.name]
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    for name, value in attributes.items():
        spec.attribute(name, value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec) and out.write_image(np.ascontiguousarray(pixels)) and out.close()
    return ImageFile(str(path))


def noise(channels: int, side: int = SIDE) -> NDArray[np.uint8]:
    return np.random.default_rng(1).integers(0, 256, (side, side, channels), np.uint8)


def linear(encoded: NDArray) -> NDArray:
    """IEC 61966-2-1."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def load(file: ImageFile, color_space: str = "auto") -> TexelImage:
    source = Source(file, color_space)  # type: ignore[arg-type]
    return load_images({source: math.inf})[source]
