"""The cases of one item, in a process of their own: `python -m defshade_cli.measure.conformance.worker ITEM OUT KEY…`.

A stage or a driver may end the process, or never let it end. Each result is a file of its own, written before the next
case begins, so that the case at work is known.
"""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from defshade_cli.errors import DefshadeError, EmptyStage
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.snapshot import write_snapshot
from defshade_cli.measure.conformance.catalogue import Case, read_item
from defshade_cli.measure.conformance.drawing import draw
from defshade_cli.measure.conformance.remarks import remark_on
from defshade_cli.measure.conformance.results import Result, result_of
from defshade_cli.passes.pipeline import Pipeline

_SUFFIX = ".webp"


def examine(case: Case, pipeline: Pipeline, out: Path) -> Result:
    """Draw, compare, and leave the pictures in `out`."""
    with _gathered_warnings() as warnings:
        try:
            drawn = draw(case, pipeline)
        except EmptyStage as error:
            return result_of(case, remark=str(error), warnings=tuple(warnings))
        except DefshadeError as error:
            return result_of(case, error=str(error), warnings=tuple(warnings))
    pictures = {name: f"{case.key}.{name}{_SUFFIX}" for name in drawn.pictures}
    for name, file in pictures.items():
        write_snapshot(drawn.pictures[name], out / file)
    return result_of(
        case,
        iou=drawn.iou,
        rmse=drawn.rmse,
        remark=remark_on(case, drawn.iou, drawn.noise),
        unsupported=drawn.unsupported,
        warnings=tuple(dict.fromkeys(warnings)),
        pictures=pictures,
        seconds={step: round(seconds, 3) for step, seconds in drawn.seconds.items()},
    )


@contextmanager
def _gathered_warnings() -> Iterator[list[str]]:
    """What the program logs as a warning meanwhile."""
    messages: list[str] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: messages.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger("defshade")
    logger.addHandler(handler)
    try:
        yield messages
    finally:
        logger.removeHandler(handler)


def main(item: Path, out: Path, keys: list[str]) -> None:
    """The item's cases with these keys."""
    with Gpu() as gpu:
        pipeline = Pipeline(gpu)
        for case in read_item(item):
            if case.key in keys:
                result = examine(case, pipeline, out)
                (out / f"{case.key}.json").write_text(json.dumps(result.as_json()), "utf-8")


if __name__ == "__main__":
    logging.getLogger("defshade").propagate = False
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
