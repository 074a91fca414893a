"""The skies of domes as textures: their images, and how densely directions are drawn from them."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.scene.environment import Environment

_HALF_MAX = 65504.0


class SkyTextures:
    """Keeps the images of the skies that were drawn."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._images: dict[Environment, moderngl.Texture] = {}

    def image(self, sky: Environment) -> moderngl.Texture:
        """Mipmapped, latitude and longitude."""
        if sky not in self._images:
            pixels = np.minimum(sky.radiance, _HALF_MAX).astype(np.float16)
            texture = self._gpu.context.texture(_size(pixels), 3, pixels.tobytes(), dtype="f2", alignment=1)
            texture.repeat_y = False
            texture.build_mipmaps()
            texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
            self._images[sky] = self._gpu.keep(texture)
        return self._images[sky]

    def density(self, values: NDArray[np.float32]) -> moderngl.Texture:
        """Of an (H, W) image, as it is; the caller's to release."""
        texture = self._gpu.context.texture(_size(values), 1, values.tobytes(), dtype="f4")
        texture.repeat_y = False
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture


def _size(pixels: NDArray[np.floating]) -> tuple[int, int]:
    return pixels.shape[1], pixels.shape[0]
