"""Results as JSON, and as tables for the docs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from defshade_cli import __version__
from defshade_cli.measure.conformance.results import LEAST_IOU, Result

_HEADER = "| stage | reference | IoU | RMSE | remark |"
_RULE = "|---|---|---:|---:|---|"


def report_of(results: Sequence[Result]) -> dict[str, Any]:
    """All results with their summary, for JSON."""
    return {
        "version": __version__,
        "least_iou": LEAST_IOU,
        "summary": summary_of(results),
        "results": [result.as_json() | {"fails": result.fails} for result in results],
    }


def summary_of(results: Sequence[Result]) -> str:
    """One sentence."""
    silhouettes = [result.iou for result in results if result.iou is not None]
    agree = sum(iou >= LEAST_IOU for iou in silhouettes)
    explained = sum(bool(r.remark) for r in results if r.iou is not None and r.iou < LEAST_IOU)
    missing = sum(bool(result.error) for result in results)
    return (
        f"{len({(r.item, r.stage) for r in results})} stages, {len(results)} pictures, {missing} missing; "
        f"{agree} of {len(silhouettes)} silhouettes agree to {LEAST_IOU}, {explained} cannot"
    )


def tables_of(results: Sequence[Result]) -> str:
    """Markdown: what was compared, then what was left out of which stage."""
    rows = [_row(result) for result in results if result.reference]
    left_out = list(_left_out(results))
    return "\n".join([summary_of(results) + ".", "", _HEADER, _RULE, *rows, "", *left_out])


def _row(result: Result) -> str:
    iou, rmse = (_number(value) for value in (result.iou, result.rmse))
    return f"| {result.item}/{result.stage} | {result.reference} | {iou} | {rmse} | {result.error or result.remark} |"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4f}"


def _left_out(results: Iterable[Result]) -> Iterator[str]:
    """A line for each stage that was not drawn whole, its reasons each once."""
    yield "| stage | what is reported |"
    yield "|---|---|"
    seen: set[tuple[str, str]] = set()
    for result in results:
        reasons = dict.fromkeys([*(issue.partition(": ")[2] for issue in result.unsupported), result.error])
        if (result.item, result.stage) in seen or not any(reasons):
            continue
        seen.add((result.item, result.stage))
        yield f"| {result.item}/{result.stage} | {'; '.join(reason for reason in reasons if reason)} |"
