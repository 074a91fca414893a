"""The graphics devices that jobs render on."""

from __future__ import annotations

from contextlib import ExitStack
from types import TracebackType
from typing import Self

from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline


class Renderer:
    """The Pipelines of the devices that jobs name, each made when a frame first needs it; a context manager.

    One renderer serves one job after another. Closed, it can be used again.
    """

    def __init__(self) -> None:
        self._stack = ExitStack()
        self._pipelines: dict[int | None, Pipeline] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def pipeline(self, device: int | None) -> Pipeline:
        """Raises GpuError."""
        if device not in self._pipelines:
            self._pipelines[device] = Pipeline(self._stack.enter_context(Gpu(device)))
        return self._pipelines[device]

    def close(self) -> None:
        self._pipelines.clear()
        self._stack.close()
