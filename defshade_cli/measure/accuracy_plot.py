"""The table of docs/accuracy.md as a plot: error against samples, a line a stage.

`python -m defshade_cli.measure.accuracy_plot PAGE` draws what the page has into images/accuracy.svg beside it.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path

from defshade_cli.measure.axes import HEIGHT, MARGIN, WIDTH, Axis, chart, legend, points
from defshade_cli.measure.sections import generated

_SAMPLES = (1, 16, 256)
_ROW = re.compile(r"^\| (\w+) \|" + r" ([\de.+-]+|not run) \|" * len(_SAMPLES), re.MULTILINE)
_BOUNDS = {16: 1e-2, 256: 2e-3}
"""relMSE that is asked for."""

_FAMILIES = {"dome": ("domes", "#27519c"), "distant": ("distant lights", "#2a7f62"), "": ("other stages", "#c1440e")}
"""How a stage's name begins → what its line is called, and its colour."""

Errors = Mapping[str, Mapping[int, float]]


def errors_in(page: str) -> Errors:
    """Stage → samples → relMSE of the table in a page; what was not run is left out."""
    rows = ((row[0], zip(_SAMPLES, row[1:], strict=True)) for row in _ROW.findall(generated(page, "accuracy")))
    return {stage: {count: float(told) for count, told in row if told != "not run"} for stage, row in rows}


def accuracy_plot(errors: Errors) -> str:
    """An SVG document; dashes rise where relMSE halves as samples double, ticks are the bounds."""
    x = Axis.around(_SAMPLES, MARGIN, WIDTH - 24.0)
    y = Axis.around([each for row in errors.values() for each in row.values()], HEIGHT - MARGIN, 52.0)
    lines = [
        f'<polyline class="front" points="{points({1: 1e-2, 256: 1e-2 / 256}, x, y)}"/>',
        *(_line(stage, row, x, y) for stage, row in errors.items()),
        *(_bound(x.at(count), y.at(bound)) for count, bound in _BOUNDS.items()),
        *legend(dict(_FAMILIES.values())),
    ]
    return chart(x, y, "samples a pixel", "relMSE", lines)


def _line(stage: str, row: Mapping[int, float], x: Axis, y: Axis) -> str:
    _, color = next(family for start, family in _FAMILIES.items() if stage.startswith(start))
    line = points(row, x, y)
    return f'<polyline points="{line}" stroke="{color}" stroke-opacity="0.7"><title>{stage}</title></polyline>'


def _bound(x: float, y: float) -> str:
    return f'<line x1="{x - 14:.1f}" x2="{x + 14:.1f}" y1="{y:.1f}" y2="{y:.1f}" stroke="#333" stroke-width="2"/>'


def main(page: Path) -> None:
    """Draw what the table of the page says."""
    plot = accuracy_plot(errors_in(page.read_text(encoding="utf-8")))
    (page.parent / "images" / "accuracy.svg").write_text(plot, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
