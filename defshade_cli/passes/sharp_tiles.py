"""Which tiles of the image show a surface that sends rays along its lobes: the others are not drawn."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import read_source
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_lists import TILE, tile_grid
from defshade_cli.passes.lighting import LightingVariant
from defshade_cli.passes.screen import Screen, regions_of
from defshade_cli.plan import Plan


class SharpTilesPass:
    """Compiled for the planes of a variant of the lighting."""

    def __init__(self, gpu: Gpu, variant: LightingVariant) -> None:
        self._context, screen = gpu.context, Screen(gpu)
        generated = {"generated/planes.glsl": read_source(variant.planes, variant.layout)}
        defines = [*variant.defines, f"LIGHT_TILE {TILE}"]
        program = gpu.shaders.program("screen.vert", "sharpest.frag", defines=defines, generated=generated)
        self._screen, self._array = screen, screen.array(program)

    def regions(self, plan: Plan, gbuffer: GBuffer, frame: Frame) -> NDArray[np.float32]:
        """(R, 4) of the image, as Screen.cover takes them."""
        target = frame.of_tiles("roughness", 1, tile_grid(plan.size))
        target.framebuffer.use()
        self._context.enable_only(moderngl.NOTHING)
        gbuffer.bind(self._array.program)
        self._screen.draw(self._array)
        return regions_of(target.read("roughness")[..., 0] < plan.roughest_rays, TILE, plan.size)
