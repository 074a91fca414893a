"""Logarithmic axes of plots as SVG."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape

from defshade_cli.dataclass import dataclass

WIDTH, HEIGHT, MARGIN = 720.0, 440.0, 64.0
"""Of a plot, in pixels."""

_STYLE = (
    "text{font:12px sans-serif;fill:#333}.grid{stroke:#ddd}polyline{fill:none}.front{stroke:#999;stroke-dasharray:5 4}"
)
OPENING = (
    f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}">',
    f'<style>{_STYLE}</style><rect width="100%" height="100%" fill="white"/>',
)
"""First lines of a document."""


@dataclass(frozen=True, slots=True)
class Axis:
    """Decades low to high onto pixels first to last."""

    low: int
    high: int
    first: float
    last: float

    @staticmethod
    def around(values: Sequence[float], first: float, last: float) -> Axis:
        """Whole decades that hold the values, which are above 0."""
        low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
        return Axis(low, max(high, low + 1), first, last)

    def at(self, value: float) -> float:
        """The pixel of a value above 0."""
        share = (math.log10(value) - self.low) / (self.high - self.low)
        return self.first + share * (self.last - self.first)

    @property
    def ticks(self) -> list[float]:
        """Its decades."""
        return [10.0**decade for decade in range(self.low, self.high + 1)]


def grid(x: Axis, y: Axis) -> Iterator[str]:
    """Lines and figures at the decades of both."""
    for tick in x.ticks:
        at = x.at(tick)
        yield f'<line class="grid" x1="{at:.1f}" x2="{at:.1f}" y1="{y.first}" y2="{y.last}"/>'
        yield text(at, y.first + 18, f"{tick:g}", "middle")
    for tick in y.ticks:
        at = y.at(tick)
        yield f'<line class="grid" x1="{x.first}" x2="{x.last}" y1="{at:.1f}" y2="{at:.1f}"/>'
        yield text(x.first - 6, at + 4, f"{tick:g}", "end")


def chart(x: Axis, y: Axis, across: str, up: str, drawn: Iterable[str]) -> str:
    """A document: the grid, what its axes are, and what is drawn in it."""
    titles = text((x.first + x.last) / 2, HEIGHT - 20, across, "middle"), text(12, 34, up)
    return "\n".join([*OPENING, *grid(x, y), *titles, *drawn, "</svg>"]) + "\n"


def points(values: Mapping[int, float] | Mapping[float, float], x: Axis, y: Axis) -> str:
    """A line through (x, y) as SVG lists its points."""
    return " ".join(f"{x.at(across):.1f},{y.at(up):.1f}" for across, up in values.items())


def legend(colors: Mapping[str, str]) -> Iterator[str]:
    """What the lines of each colour are, at the right."""
    for row, (name, color) in enumerate(colors.items()):
        at = 66 + 18 * row
        yield f'<line x1="{WIDTH - 140:.0f}" x2="{WIDTH - 120:.0f}" y1="{at}" y2="{at}" stroke="{color}"/>'
        yield text(WIDTH - 112, at + 4, name)


def text(x: float, y: float, words: str, anchor: str = "start") -> str:
    """A line of words; anchor: which end stands at x, as SVG names it."""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(words)}</text>'
