"""Images that lights shine through, from files."""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from defshade_cli.image.packed import stamp
from defshade_cli.scene.light import Light, RectLight
from defshade_cli.scene.texture import ImageFile

if TYPE_CHECKING:
    from defshade_cli.image.texture import TexelImage
    from defshade_cli.scene.radiance_map import RadianceMap

log = logging.getLogger("defshade")


def with_texture(light: Light) -> Light:
    """The light with its image in memory; even, with a warning, where it cannot be read."""
    if not isinstance(light, RectLight) or light.texture is None or light.radiance_map is not None:
        return light
    found = read_radiance_map(light.texture)
    if found is None:
        log.warning("%s: its texture cannot be read; the light is even", light.path)
    return replace(light, radiance_map=found)


def read_radiance_map(file: ImageFile) -> RadianceMap | None:
    """The image, scene-linear Rec. 709; read once as long as the file does not change. None, logged, if it fails."""
    return _read(file, stamp(file))


@lru_cache(maxsize=8)
def _read(file: ImageFile, _version: int) -> RadianceMap | None:
    from defshade_cli.image.texture import Source, load_images
    from defshade_cli.scene.radiance_map import RadianceMap

    source = Source(file, "auto")
    images = load_images({source: math.inf})
    return RadianceMap(_linear(images[source])) if source in images else None


def _linear(image: TexelImage) -> np.ndarray:
    """(H, W, 3) row 0 at the top, none negative."""
    texels = image.texels.astype(np.float32) / (255.0 if image.texels.dtype == np.uint8 else 1.0)
    colors = texels[::-1, :, :3] if texels.shape[2] >= 3 else np.repeat(texels[::-1, :, :1], 3, axis=2)
    if image.srgb:
        from defshade_cli.image.transfer import linear

        colors = linear(colors)
    return np.maximum(colors, 0.0)
