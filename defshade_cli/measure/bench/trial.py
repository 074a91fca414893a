"""One combination of settings, what drawing with it cost and how far its picture is from the converged one."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from defshade_cli.dataclass import dataclass
from defshade_cli.settings import Filter, Layout, RenderSettings

Cost = Literal["wall", "cpu"]


@dataclass(frozen=True, slots=True)
class Choice:
    """What a sweep varies; fields are those of RenderSettings."""

    layout: Layout
    samples: int
    shadows: bool
    filter: Filter

    def applied(self, settings: RenderSettings) -> RenderSettings:
        """The settings with this choice made."""
        return replace(settings, layout=self.layout, samples=self.samples, shadows=self.shadows, filter=self.filter)

    def __str__(self) -> str:
        """As the options that choose it: `--gbuffer float --samples 16`."""
        options = [f"--gbuffer {self.layout}", f"--samples {self.samples}"]
        if not self.shadows:
            options.append("--no-shadows")
        if self.filter != RenderSettings().filter:
            options.append(f"--filter {self.filter}")
        return " ".join(options)


@dataclass(frozen=True, slots=True)
class Trial:
    """wall, cpu: seconds to draw a frame, the median of the rounds; cpu counts every thread of the process.

    rel_mse, flip: of image.compare, against the converged picture; flip is None where the package is missing.
    """

    choice: Choice
    wall: float
    cpu: float
    rel_mse: float
    flip: float | None

    def cost(self, of: Cost) -> float:
        """Seconds, by the clock or of the processor."""
        return self.wall if of == "wall" else self.cpu
