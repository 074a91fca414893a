"""The report of a batch: a record of every frame, and a page that shows them.

NAME.html  self-contained: thumbnails by stage and frame, layers to switch, times, errors, logs
NAME.json  the same facts
"""

from __future__ import annotations

import html
import json
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from defshade_cli.errors import OutputError
from defshade_cli.farm.tasks import Outcome
from defshade_cli.image.appearing import write_text
from defshade_cli.image.page import filled
from defshade_cli.image.reading import read_header
from defshade_cli.image.thumbnail import thumbnails

_TEMPLATE = Path(__file__).with_name("report.html")
_FACTS = ("samples", "error", "stopped_by")


def write_report(outcomes: Sequence[Outcome], seconds: float, path: Path) -> None:
    """The page at `path`, and its record beside it. seconds: of the whole batch. Raises OutputError."""
    frames = [_frame(outcome) for outcome in sorted(outcomes, key=_order)]
    record = {"seconds": round(seconds, 3), "frames": [{k: v for k, v in f.items() if k != "images"} for f in frames]}
    layers = dict.fromkeys(layer for frame in frames for layer in frame["images"])
    page = filled(
        _TEMPLATE,
        summary=html.escape(_summary(frames, seconds)),
        layers="".join(_button(layer) for layer in layers),
        stages="".join(_stages(frames)),
    )
    write_text(path, page)
    write_text(path.with_suffix(".json"), json.dumps(record, indent=2) + "\n")


def _order(outcome: Outcome) -> tuple[str, float]:
    return str(outcome.stage), -1.0 if outcome.frame is None else outcome.frame


def _frame(outcome: Outcome) -> dict[str, Any]:
    """What the record says of a frame, and as `images` its thumbnails by layer."""
    header, images, log = _looked_at(outcome)
    return {
        "stage": str(outcome.stage),
        "frame": outcome.frame,
        "skipped": outcome.skipped,
        "failure": outcome.error,
        "log": log,
        "attempts": outcome.task.attempt,
        "seconds": {step: round(taken, 4) for step, taken in outcome.seconds.items()},
        "paths": [str(path) for path in outcome.paths],
        "images": images,
        **{name: header[name] for name in _FACTS if name in header},
    }


def _looked_at(outcome: Outcome) -> tuple[dict[str, Any], dict[str, str], str]:
    """The header and the thumbnails of the frame's first file, and the log with what is wrong with that."""
    if not outcome.paths:
        return {}, {}, outcome.log
    try:
        return read_header(outcome.paths[0]), thumbnails(outcome.paths[0]), outcome.log
    except OutputError as error:
        return {}, {}, f"{outcome.log}{error}\n"


def _summary(frames: Sequence[dict[str, Any]], seconds: float) -> str:
    failed, skipped = (sum(bool(frame[key]) for frame in frames) for key in ("failure", "skipped"))
    rendered = len(frames) - failed - skipped
    return f"{len(frames)} frames in {seconds:.1f} s: {rendered} rendered, {skipped} skipped, {failed} failed"


def _stages(frames: Sequence[dict[str, Any]]) -> Iterator[str]:
    for stage, those in groupby(frames, key=lambda frame: frame["stage"]):
        tiles = "".join(_tile(frame) for frame in those)
        yield f'<section><h2>{html.escape(stage)}</h2><div class="frames">{tiles}</div></section>'


def _tile(frame: dict[str, Any]) -> str:
    name = "default" if frame["frame"] is None else f"{frame['frame']:g}"
    images = "".join(_image(*image) for image in frame["images"].items())
    cost = "skipped" if frame["skipped"] else f"{sum(frame['seconds'].values()):.2f} s"
    count = frame.get("samples", 0)
    samples = f", {count} sample{'s' * (count != 1)}" if count else ""
    said = frame["failure"] or frame["log"].strip()
    kind = "failed" if frame["failure"] else "warned" if said else "fine"
    caption = f"<figcaption><b>{name}</b> {cost}{samples}</figcaption>"
    return f'<figure class="{kind}">{images}{caption}{_log(said, frame["log"]) if said else ""}</figure>'


def _image(layer: str, source: str) -> str:
    return f'<img data-layer="{html.escape(layer)}" src="{source}" alt="">'


def _log(said: str, log: str) -> str:
    head = html.escape(said.splitlines()[0])
    return f"<details><summary>{head}</summary><pre>{html.escape(log)}</pre></details>"


def _button(layer: str) -> str:
    return f'<button data-layer="{html.escape(layer)}">{html.escape(layer)}</button>'
