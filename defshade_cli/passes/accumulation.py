"""Samples summed in float32, in steps that are short enough not to drift."""

from __future__ import annotations

from functools import cached_property

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.targets import Target
from defshade_cli.passes.frame import Frame, Size
from defshade_cli.passes.screen import Screen

STEP = 256
"""Samples in a step. Sums of n terms are off by n ε/2 at most: 1.5e-5 in a step, and as much again over 256 steps."""


class AccumulationPass:
    """Adds samples to `step`, and every STEP of them to `total`, which only longer sums have."""

    def __init__(self, gpu: Gpu, frame: Frame, screen: Screen) -> None:
        self._context, self._frame, self._screen = gpu.context, frame, screen
        self._whole, self._shaders = Screen(gpu), gpu.shaders

    @cached_property
    def _arrays(self) -> dict[Screen, moderngl.VertexArray]:
        """Compiled where a second sample is added."""
        program = self._shaders.program("screen.vert", "accumulate.frag")
        return {screen: screen.array(program) for screen in (self._screen, self._whole)}

    step: Target
    total: Target | None

    def begin(self, size: Size, samples: int) -> None:
        """Empty sums of (width, height) for at most `samples`."""
        self.count, self._is_single = 0, samples == 1
        self.total = self._frame.radiance("total", size) if samples > STEP else None
        if not self._is_single:
            self.step = self._frame.radiance("step", size)
            for target in self.sums:
                target.framebuffer.clear()

    @property
    def sums(self) -> list[Target]:
        """What together is the sum."""
        return [self.step, self.total] if self.total else [self.step]

    def add(self, sample: Target) -> None:
        """One sample more, in the regions of the screen; a single one is its own sum."""
        self.count += 1
        if self._is_single:
            self.step = sample
            return
        self._add(sample, self.step, self._screen)
        if self.total and self.count % STEP == 0:
            self._add(self.step, self.total, self._whole)
            self.step.framebuffer.clear()

    def mean(self, counts: NDArray[np.int32]) -> NDArray[np.float32]:
        """(height, width, 4); counts: (height, width, 1) samples that each pixel got."""
        if self._is_single:
            return self.step.read("radiance")
        step, *total = (target.read("radiance") for target in self.sums)
        summed = np.add(step, *total, dtype=np.float64) if total else step
        return np.divide(summed, counts).astype(np.float32)

    def _add(self, term: Target, to: Target, screen: Screen) -> None:
        to.framebuffer.use()
        self._context.enable_only(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE
        term.textures["radiance"].use(0)
        self._arrays[screen].program["sample_radiance"] = 0
        screen.draw(self._arrays[screen])
