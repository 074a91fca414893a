"""The variance of each pixel's mean, from the means of batches of its samples.

Samples are points of one scrambled sequence, spread more evenly than chance: the variance among them says little about
their mean. But the samples 0…b−1, b…2b−1 … of a Sobol' sequence are each a net as good as the next, for b a power of
two: batches as even in themselves as independent sequences of that length. The variance among their means, over their
number, is the error of the mean as far as the batches know nothing of each other. They do: together they are a finer
net, and where the integrand is smooth they cancel. The estimate then errs on the safe side; docs/accuracy.md measures
by how much. Independently scrambled batches would have no such bias, but a larger error to estimate, for no batch would
fill the gaps of another. Owen 1997, "Monte Carlo Variance of Scrambled Net Quadrature".
"""

from __future__ import annotations

import math

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.targets import Target
from defshade_cli.passes.accumulation import AccumulationPass
from defshade_cli.passes.frame import Frame, Size
from defshade_cli.passes.screen import Screen

BATCHES = 8
"""Batches at most: where another would begin, two become one. Only luminance is kept of them."""


class BatchMeansPass:
    """Keeps the sum's luminance at the end of each batch."""

    def __init__(self, gpu: Gpu, frame: Frame, screen: Screen) -> None:
        self._context, self._frame, self._screen = gpu.context, frame, screen
        self._luminance = screen.array(gpu.shaders.program("screen.vert", "luminance.frag"))
        defines = [f"BATCHES {BATCHES}"]
        self._statistics = screen.array(gpu.shaders.program("screen.vert", "batch_means.frag", defines=defines))

    def begin(self, size: Size) -> None:
        """No batches yet, of an image of (width, height)."""
        self._free = [self._frame.radiance(f"batch {i}", size, components=1) for i in range(BATCHES)]
        self._result = self._frame.radiance("mean and variance", size, components=2)
        self._result.framebuffer.clear(green=math.inf)
        self._marks: list[Target] = []
        self._batch_samples, self.count = 1, 0

    @property
    def are_complete(self) -> bool:
        """Do the batches hold all samples, and is their number as great as it becomes?"""
        return self.count == BATCHES * self._batch_samples

    def note(self, accumulation: AccumulationPass) -> None:
        """Once after each sample."""
        if self.are_complete:
            self._free += self._marks[0::2]
            self._marks = self._marks[1::2]
            self._batch_samples *= 2
        self.count = accumulation.count
        if self.count % self._batch_samples == 0:
            self._mark(accumulation.sums)

    def read(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(height, width, 1) each: mean luminance, and the variance of the mean; infinite from a single batch.

        Outside the screen's regions they are what they were when read last.
        """
        if len(self._marks) > 1:
            self._draw_statistics()
        result = self._result.read("radiance")
        return result[..., :1], result[..., 1:]

    def _mark(self, sums: list[Target]) -> None:
        mark = self._free.pop()
        mark.framebuffer.use()
        for i, target in enumerate(sums):
            self._context.enable_only(moderngl.BLEND if i else moderngl.NOTHING)
            self._context.blend_func = moderngl.ONE, moderngl.ONE
            target.textures["radiance"].use(0)
            self._screen.draw(self._luminance)
        self._marks.append(mark)

    def _draw_statistics(self) -> None:
        self._result.framebuffer.use()
        self._context.enable_only(moderngl.NOTHING)
        for unit in range(BATCHES):
            self._marks[min(unit, len(self._marks) - 1)].textures["radiance"].use(unit)
        program = self._statistics.program
        program["marks"] = list(range(BATCHES))
        program["batches"], program["batch_samples"] = len(self._marks), float(self._batch_samples)
        program["samples"] = float(self.count)
        self._screen.draw(self._statistics)
