"""Run time against error as SVG."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from defshade_cli.measure.axes import HEIGHT, MARGIN, WIDTH, Axis, chart, text
from defshade_cli.measure.bench.front import pareto_front
from defshade_cli.measure.bench.sweep import Bench
from defshade_cli.measure.bench.trial import Cost, Trial
from defshade_cli.settings import LAYOUTS

_LEAST = 1e-9  # of an error that is drawn: a picture equal to the reference has none
_COLORS = dict(zip(LAYOUTS, ("#c1440e", "#2a7f62", "#27519c"), strict=True))
_LABELS = dict(zip(LAYOUTS, (-5.0, 4.0, 13.0), strict=True))  # beside the dot, so that they do not meet
_TITLES = {"wall": "seconds to draw a frame", "cpu": "processor seconds to draw a frame"}


def plot(bench: Bench, cost: Cost) -> str:
    """An SVG document: a dot a trial, hollow without shadows; a dashed line along the Pareto front."""
    x = Axis.around([trial.cost(cost) for trial in bench.trials], MARGIN, WIDTH - 24.0)
    y = Axis.around([_error(trial) for trial in bench.trials], HEIGHT - MARGIN, 52.0)
    front = " ".join(f"{x.at(t.cost(cost)):.1f},{y.at(_error(t)):.1f}" for t in pareto_front(bench.trials, cost))
    width, height = bench.size
    lines = [
        text(MARGIN, 22, f"{bench.stage.name}, {width}x{height}, {bench.device}"),
        f'<polyline class="front" points="{front}"/>',
        *(_dot(trial, x.at(trial.cost(cost)), y.at(_error(trial))) for trial in bench.trials),
        *_legend(bench),
    ]
    return chart(x, y, _TITLES[cost], "relMSE", lines)


def _error(trial: Trial) -> float:
    return max(trial.rel_mse, _LEAST)


def _dot(trial: Trial, x: float, y: float) -> str:
    """With its settings as a tooltip, and its samples beside it."""
    color = _COLORS[trial.choice.layout]
    fill = color if trial.choice.shadows else "white"
    title = f"<title>{escape(str(trial.choice))}: relMSE {trial.rel_mse:.3g}</title>"
    circle = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="{fill}" stroke="{color}" stroke-width="1.5">'
    return f"{circle}{title}</circle>{text(x + 7, y + _LABELS[trial.choice.layout], str(trial.choice.samples))}"


def _legend(bench: Bench) -> Iterator[str]:
    shown = [layout for layout in LAYOUTS if any(trial.choice.layout == layout for trial in bench.trials)]
    for row, layout in enumerate(shown):
        y = 66 + 18 * row
        yield f'<circle cx="{WIDTH - 100:.0f}" cy="{y}" r="4.5" fill="{_COLORS[layout]}"/>'
        yield text(WIDTH - 88, y + 4, layout)
    if not all(trial.choice.shadows for trial in bench.trials):
        yield text(WIDTH - 112, 66 + 18 * len(shown) + 4, "○ no shadows")
