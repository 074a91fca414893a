"""`defshade render`."""

from __future__ import annotations

import logging
import shlex
import sys
from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING

import click

from defshade_cli.cli.ending import ended_by_sigterm
from defshade_cli.cli.options import HeadedCommand, Reporting, epilog, takes_job
from defshade_cli.cli.progress import frame_name, make_progress, start_logging
from defshade_cli.cli.stats import Stats
from defshade_cli.garbage import uncollected
from defshade_cli.settings import RenderJob

if TYPE_CHECKING:
    from defshade_cli.rendering import FrameResult

log = logging.getLogger("defshade")

_EPILOG = epilog(
    "defshade render scene.usda",
    "defshade render scene.usda -o out.exr -o out.png --size 1920x1080 --samples 16",
    "defshade render shot.usd --camera /cams/main --frames 1:48 -o 'out/{scene}.####.exr'",
    "defshade render shot.usd --layers beauty,depth,normal --split-layers",
    "defshade render shot.usd --frames 1:240 --existing skip --progress alf --stats stats.json",
    layers=True,
)


@click.command(cls=HeadedCommand, epilog=_EPILOG)
@takes_job()
def render(job: RenderJob, reporting: Reporting) -> None:
    """Render SCENE, a USD stage, to image files.

    The paths of the files go to stdout, one a line.
    """
    execute(job, reporting)


def execute(job: RenderJob, reporting: Reporting) -> None:
    """Render `job`, telling of it as `reporting` says. Raises the errors of errors.py."""
    start_logging(reporting)
    if reporting.contained:
        from defshade_cli.cli.contained import execute_contained

        execute_contained(job, reporting)
        return
    frames = max(1, len(job.frames))
    with ended_by_sigterm(), make_progress(reporting, frames) as progress, Stats(job, reporting.stats) as stats:
        for result in _results(job):
            progress.frame(result)
            stats.add(result)
            _log_details(result)
            for path in result.paths:
                click.echo(path)


def _results(job: RenderJob) -> Iterator[FrameResult]:
    """Python's search for cycles begins with the third frame: of one picture's objects most stay until the end."""
    with uncollected():
        from defshade_cli.rendering import run

        results = run(job, command=shlex.join(["defshade", *sys.argv[1:]]))
        yield from islice(results, 2)
    yield from results


def _log_details(result: FrameResult) -> None:
    log.info("frame %s: %s", frame_name(result.frame), ", ".join(f"{k} {v:.3f} s" for k, v in result.seconds.items()))
    for decision in (decision for image in result.images if image.plan for decision in image.plan.decisions):
        log.info("%s: %s, %s", decision.subject, decision.choice, decision.reason)
