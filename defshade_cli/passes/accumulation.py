"""Samples: where in its pixel each one lies, and their sum in float32."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import moderngl

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.targets import Target

_DIMENSIONS = 6


@dataclass(frozen=True, slots=True)
class Sample:
    """Where one sample lies, each pair in the unit square: in its pixel, in a shadow map's texel, on every light.

    index 0 is the centre of the pixel; a frame of one sample has no other.
    """

    index: int
    pixel: tuple[float, float]
    texel: tuple[float, float]
    light: tuple[float, float]

    @property
    def texel_offset(self) -> tuple[float, float]:
        """From a texel's centre, in texels."""
        return self.texel[0] - 0.5, self.texel[1] - 0.5

    def on_light(self, number: int) -> tuple[float, float]:
        """The place on the number-th light: the same pattern for all, each shifted by its own amount."""
        u, v = _generator(number, 2)
        return (self.light[0] + u) % 1.0, (self.light[1] + v) % 1.0


CENTRE = Sample(0, (0.5, 0.5), (0.5, 0.5), (0.5, 0.5))


def samples(count: int) -> Iterator[Sample]:
    """`count` samples of the R sequence, (1/2 + i · α) mod 1; the first lies at the centre of everything."""
    for i in range(count):
        u = [(0.5 + i * a) % 1.0 for a in _alphas(_DIMENSIONS)]
        yield Sample(i, (u[0], u[1]), (u[2], u[3]), (u[4], u[5]))


def _alphas(dimensions: int) -> list[float]:
    """Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences": powers of 1/φ, φ^(d+1) = φ + 1."""
    phi = 2.0
    for _ in range(60):
        phi = (1.0 + phi) ** (1.0 / (dimensions + 1))
    return [phi ** -(k + 1) for k in range(dimensions)]


def _generator(index: int, dimensions: int) -> list[float]:
    return [(index * a) % 1.0 for a in _alphas(dimensions)]


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
