"""The emission pass: what surfaces send by themselves, and coverage; the first of a sample's radiance."""

from __future__ import annotations

import moderngl

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import read_source
from defshade_cli.image.layers import DEFAULT_GROUP
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.passes.lighting import LightingVariant
from defshade_cli.passes.screen import Screen


class EmissionPass:
    """Compiled for one variant of the lighting."""

    def __init__(self, gpu: Gpu, variant: LightingVariant, screen: Screen) -> None:
        self._context, self._screen = gpu.context, screen
        generated = {"generated/planes.glsl": read_source(variant.planes, variant.layout)}
        program = gpu.shaders.program("screen.vert", "emission.frag", defines=variant.defines, generated=generated)
        self._array = screen.array(program)

    def draw(self, gbuffer: GBuffer, targets: LightTargets) -> None:
        """The sample's radiance is overwritten, and the group of what is emitted grows."""
        targets.radiance.framebuffer.use()
        targets.radiance.framebuffer.depth_mask = False
        self._context.enable_only(moderngl.NOTHING)
        gbuffer.bind(self._array.program)
        self._screen.draw(self._array)
        if DEFAULT_GROUP in targets.sums:
            targets.sums[DEFAULT_GROUP].framebuffer.use()
            self._context.enable_only(moderngl.BLEND)
            self._context.blend_func = moderngl.ONE, moderngl.ONE
            self._screen.draw(self._array)
