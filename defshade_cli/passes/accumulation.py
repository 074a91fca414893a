"""Samples: where in its pixel each one lies, and their sum in float32."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.targets import Target

# Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences": powers of 1/ρ, ρ³ = ρ + 1.
_R2 = (0.7548776662466927, 0.5698402909980532)


def pixel_positions(count: int) -> Iterator[tuple[float, float]]:
    """`count` places in the unit square, the R2 sequence; the first, and so a single one, is the centre."""
    for i in range(count):
        yield ((0.5 + i * _R2[0]) % 1.0, (0.5 + i * _R2[1]) % 1.0)


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
