"""Samples summed in float32."""

from __future__ import annotations

import moderngl

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.targets import Target


class AccumulationPass:
    """Adds one target to another."""

    def __init__(self, gpu: Gpu) -> None:
        self._context = gpu.context
        self._program = gpu.shaders.program("screen.vert", "accumulate.frag")
        self._screen = gpu.keep(gpu.context.vertex_array(self._program, []))

    def add(self, sample: Target, total: Target) -> None:
        """total += sample, every channel."""
        total.framebuffer.use()
        self._context.enable_only(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE
        sample.textures["radiance"].use(0)
        self._program["sample_radiance"] = 0
        self._screen.render(vertices=3)
