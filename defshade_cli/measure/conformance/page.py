"""Results as one self-contained page: ours, the reference and what differs, with numbers, to sort and search."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterator, Sequence
from pathlib import Path

from defshade_cli.measure.conformance.report import summary_of
from defshade_cli.measure.conformance.results import LEAST_IOU, Result

_TEMPLATE = Path(__file__).with_name("page.html")
_CAPTIONS = {"ours": "defshade", "reference": "reference", "difference": "difference"}


def page_of(results: Sequence[Result], pictures: Path) -> str:
    """HTML with every picture inside."""
    cards = "\n".join(_card(result, pictures) for result in results)
    page = _TEMPLATE.read_text("utf-8")
    return page.replace("{{summary}}", html.escape(summary_of(results))).replace("{{cards}}", cards)


def _card(result: Result, pictures: Path) -> str:
    iou = "" if result.iou is None else f"{result.iou:.6f}"
    rmse = "" if result.rmse is None else f"{result.rmse:.6f}"
    name = f"{result.item} {result.stage} {result.reference} {result.maker}"
    return (
        f'<article class="{_verdict(result)}" data-iou="{iou}" data-rmse="{rmse}" data-name="{html.escape(name)}">\n'
        f"<header><h2>{html.escape(result.stage)}</h2><p>{html.escape(_origin(result))}</p>{_numbers(result)}</header>\n"
        f'<div class="pictures">{"".join(_figures(result, pictures))}</div>\n'
        f"{''.join(_notes(result))}</article>"
    )


def _verdict(result: Result) -> str:
    if result.fails:
        return "fails"
    if result.iou is None:
        return "looked"
    return "agrees" if result.iou >= LEAST_IOU else "cannot"


def _origin(result: Result) -> str:
    made = f"{result.reference} by {result.maker}" if result.reference else "no reference"
    return f"{result.item} · {made}"


def _numbers(result: Result) -> str:
    numbers = (("IoU", result.iou), ("RMSE", result.rmse))
    cells = "".join(f"<dt>{name}</dt><dd>{value:.4f}</dd>" for name, value in numbers if value is not None)
    return f"<dl>{cells}</dl>" if cells else ""


def _figures(result: Result, pictures: Path) -> Iterator[str]:
    for kind, file in result.pictures.items():
        data = base64.b64encode((pictures / file).read_bytes()).decode()
        mime = f"image/{file.rpartition('.')[2]}"
        caption = _CAPTIONS[kind]
        yield (
            f'<figure><img loading="lazy" alt="{caption} of {html.escape(result.stage)}" '
            f'src="data:{mime};base64,{data}"><figcaption>{caption}</figcaption></figure>'
        )


def _notes(result: Result) -> Iterator[str]:
    if said := result.error or result.remark:
        yield f'<p class="remark">{html.escape(said)}</p>'
    reported = [*result.unsupported, *result.warnings]
    if reported:
        lines = "".join(f"<li>{html.escape(line)}</li>" for line in reported)
        yield f"<details><summary>{len(reported)} reported</summary><ul>{lines}</ul></details>"
