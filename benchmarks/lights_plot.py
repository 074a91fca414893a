"""The table of docs/performance.md as a plot: processor seconds against lights that cover as much together.

`python benchmarks/lights_plot.py PAGE` draws what the page has into images/lights.svg beside it.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path

from defshade_cli.measure.axes import HEIGHT, MARGIN, WIDTH, Axis, chart, legend, points
from defshade_cli.measure.sections import generated

_WAYS = {"volumes": "#27519c", "tiles": "#c1440e", "whole image": "#2a7f62"}
_ROW = re.compile(r"^\| ([\d,]+) \| [\d.]+ \| [\d.]+ \| ([\d.]+) \| ([\d.]+) \| ([\d.]*) *\|$", re.MULTILINE)

Seconds = Mapping[str, Mapping[int, float]]


def seconds_in(page: str) -> Seconds:
    """Way → lights → processor seconds of the table in a page; of a number of lights the first row counts."""
    found: dict[str, dict[int, float]] = {way: {} for way in _WAYS}
    for lights, *cells in _ROW.findall(generated(page, "lights")):
        for way, told in zip(_WAYS, cells, strict=True):
            if told:
                found[way].setdefault(int(lights.replace(",", "")), float(told))
    return found


def lights_plot(seconds: Seconds) -> str:
    """An SVG document; dashes rise as the number of lights does."""
    x = Axis.around([count for row in seconds.values() for count in row], MARGIN, WIDTH - 24.0)
    y = Axis.around([each for row in seconds.values() for each in row.values()], HEIGHT - MARGIN, 52.0)
    first, least = min(seconds["tiles"].items())
    times = 10.0**y.high / least
    fair = points({first: least, first * times: least * times}, x, y)
    lines = [
        f'<polyline class="front" points="{fair}"/>',
        *(f'<polyline points="{points(row, x, y)}" stroke="{_WAYS[way]}"/>' for way, row in seconds.items()),
        *legend(_WAYS),
    ]
    return chart(x, y, "lights", "CPU-seconds", lines)


def draw_plot(page: Path) -> None:
    plot = lights_plot(seconds_in(page.read_text(encoding="utf-8")))
    (page.parent / "images" / "lights.svg").write_text(plot, encoding="utf-8")


if __name__ == "__main__":
    draw_plot(Path(sys.argv[1]))
