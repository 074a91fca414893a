"""Small pictures of the layers in an image file, for pages."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from defshade_cli.image.colour import Pixels, display_transform, picture
from defshade_cli.image.encoders import EXR, suffix_of
from defshade_cli.image.inline import jpeg_address
from defshade_cli.image.layers import BEAUTY, LAYERS
from defshade_cli.image.reading import read

_WIDTH = 240


def thumbnails(path: Path) -> dict[str, str]:
    """Layer → a picture as a `data:` address; layers without a look of their own are left out.

    Raises OutputError for a file that cannot be read, UsageError for $OCIO without a display.
    """
    layers = read(path)
    if suffix_of(path) != EXR:
        return {BEAUTY: jpeg_address(_reduced(layers[BEAUTY]))}
    transform = display_transform()
    shown = {name: _reduced(pixels) for name, pixels in layers.items() if name in LAYERS}
    return {name: jpeg_address(picture(LAYERS[name], pixels, transform, alpha=False)) for name, pixels in shown.items()}


def _reduced(pixels: Pixels) -> Pixels:
    """Every n-th pixel: no mean of depths, and quick."""
    step = max(1, -(-pixels.shape[1] // _WIDTH))
    return np.ascontiguousarray(pixels[::step, ::step])
