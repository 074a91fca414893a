"""The graphics devices that jobs render on."""

from __future__ import annotations

from contextlib import ExitStack
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.image.colour import DisplayTransform
from defshade_cli.image.display_shader import DisplayShader, display_shader
from defshade_cli.image.display_table import kept_table
from defshade_cli.passes.display import DisplayPass
from defshade_cli.passes.pipeline import Pipeline


class Renderer:
    """The Pipelines of the devices that jobs name, each made when a frame first needs it; a context manager.

    One renderer serves one job after another. Closed, it can be used again.
    lone: a single image will be drawn.
    """

    def __init__(self, *, lone: bool = False) -> None:
        self._lone = lone
        self._stack = ExitStack()
        self._gpus: dict[int | None, Gpu] = {}
        self._pipelines: dict[int | None, Pipeline] = {}
        self._displays: dict[tuple[int | None, DisplayTransform], DisplayPass | None] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def pipeline(self, device: int | None) -> Pipeline:
        """Raises GpuError."""
        if device not in self._pipelines:
            self._gpus[device] = self._stack.enter_context(Gpu(device))
            self._pipelines[device] = Pipeline(self._gpus[device], lone=self._lone)
        return self._pipelines[device]

    def display(self, device: int | None, transform: DisplayTransform) -> DisplayPass | None:
        """The pass that shows images, on a device that a pipeline is of; None where there is no shader for it."""
        if (device, transform) not in self._displays:
            shader = display_shader(transform)
            self._displays[device, transform] = _display(self._gpus[device], shader) if shader else None
        return self._displays[device, transform]

    def close(self) -> None:
        """Free what is held on all devices."""
        for kept in (self._gpus, self._pipelines, self._displays):
            kept.clear()
        self._stack.close()


def _display(gpu: Gpu, shader: DisplayShader) -> DisplayPass:
    """With a table, where one is kept or can be."""

    def show(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
        return DisplayPass(gpu, shader).show(pixels, straight=False).astype(np.float32)

    return DisplayPass(gpu, shader, kept_table(shader, show))
