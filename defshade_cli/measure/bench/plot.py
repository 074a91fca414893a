"""Run time against error as SVG, both axes logarithmic."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

from defshade_cli.measure.bench.front import pareto_front
from defshade_cli.measure.bench.sweep import Bench
from defshade_cli.measure.bench.trial import Cost, Trial
from defshade_cli.settings import LAYOUTS

_WIDTH, _HEIGHT, _MARGIN = 720.0, 440.0, 64.0
_LEAST = 1e-9  # of an error that is drawn: a picture equal to the reference has none
_COLORS = dict(zip(LAYOUTS, ("#c1440e", "#2a7f62", "#27519c"), strict=True))
_LABELS = dict(zip(LAYOUTS, (-5.0, 4.0, 13.0), strict=True))  # beside the dot, so that they do not meet
_TITLES = {"wall": "seconds to draw a frame", "cpu": "processor seconds to draw a frame"}
_STYLE = "text{font:12px sans-serif;fill:#333}.grid{stroke:#ddd}.front{fill:none;stroke:#999;stroke-dasharray:5 4}"


@dataclass(frozen=True, slots=True)
class _Axis:
    """Decades low to high onto pixels first to last."""

    low: int
    high: int
    first: float
    last: float

    @staticmethod
    def around(values: Sequence[float], first: float, last: float) -> _Axis:
        low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
        return _Axis(low, max(high, low + 1), first, last)

    def at(self, value: float) -> float:
        share = (math.log10(value) - self.low) / (self.high - self.low)
        return self.first + share * (self.last - self.first)

    @property
    def ticks(self) -> list[float]:
        return [10.0**decade for decade in range(self.low, self.high + 1)]


def plot(bench: Bench, cost: Cost) -> str:
    """An SVG document: a dot a trial, hollow without shadows; a dashed line along the Pareto front."""
    x = _Axis.around([trial.cost(cost) for trial in bench.trials], _MARGIN, _WIDTH - 24.0)
    y = _Axis.around([_error(trial) for trial in bench.trials], _HEIGHT - _MARGIN, 52.0)
    front = " ".join(f"{x.at(t.cost(cost)):.1f},{y.at(_error(t)):.1f}" for t in pareto_front(bench.trials, cost))
    width, height = bench.size
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:.0f} {_HEIGHT:.0f}">',
        f'<style>{_STYLE}</style><rect width="100%" height="100%" fill="white"/>',
        _text(_MARGIN, 22, f"{bench.stage.name}, {width}x{height}, {bench.device}"),
        *_grid(x, y),
        _text((x.first + x.last) / 2, _HEIGHT - 20, _TITLES[cost], "middle"),
        _text(12, 34, "relMSE"),
        f'<polyline class="front" points="{front}"/>',
        *(_dot(trial, x.at(trial.cost(cost)), y.at(_error(trial))) for trial in bench.trials),
        *_legend(bench),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _error(trial: Trial) -> float:
    return max(trial.rel_mse, _LEAST)


def _grid(x: _Axis, y: _Axis) -> Iterator[str]:
    for tick in x.ticks:
        at = x.at(tick)
        yield f'<line class="grid" x1="{at:.1f}" x2="{at:.1f}" y1="{y.first}" y2="{y.last}"/>'
        yield _text(at, y.first + 18, f"{tick:g}", "middle")
    for tick in y.ticks:
        at = y.at(tick)
        yield f'<line class="grid" x1="{x.first}" x2="{x.last}" y1="{at:.1f}" y2="{at:.1f}"/>'
        yield _text(x.first - 6, at + 4, f"{tick:g}", "end")


def _dot(trial: Trial, x: float, y: float) -> str:
    """With its settings as a tooltip, and its samples beside it."""
    color = _COLORS[trial.choice.layout]
    fill = color if trial.choice.shadows else "white"
    title = f"<title>{escape(str(trial.choice))}: relMSE {trial.rel_mse:.3g}</title>"
    circle = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="{fill}" stroke="{color}" stroke-width="1.5">'
    return f"{circle}{title}</circle>{_text(x + 7, y + _LABELS[trial.choice.layout], str(trial.choice.samples))}"


def _legend(bench: Bench) -> Iterator[str]:
    shown = [layout for layout in LAYOUTS if any(trial.choice.layout == layout for trial in bench.trials)]
    for row, layout in enumerate(shown):
        y = 66 + 18 * row
        yield f'<circle cx="{_WIDTH - 100:.0f}" cy="{y}" r="4.5" fill="{_COLORS[layout]}"/>'
        yield _text(_WIDTH - 88, y + 4, layout)
    if not all(trial.choice.shadows for trial in bench.trials):
        yield _text(_WIDTH - 112, 66 + 18 * len(shown) + 4, "○ no shadows")


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'
