"""A job in a process of its own: what crashes there is an error here."""

from __future__ import annotations

import shlex
import sys

import click

from defshade_cli.cli.ending import ended_by_sigterm
from defshade_cli.cli.options import Reporting
from defshade_cli.cli.progress import make_progress
from defshade_cli.cli.tally import Tally
from defshade_cli.errors import ContainedError
from defshade_cli.settings import RenderJob


def execute_contained(job: RenderJob, reporting: Reporting) -> None:
    """Render `job` in a worker process, within the limits of `reporting`. Raises ContainedError."""
    from defshade_cli.farm.limits import Limits
    from defshade_cli.farm.local import LocalEngine
    from defshade_cli.farm.tasks import Chunk, check_batch, leaving_no_leftovers

    check_batch([job])
    command = shlex.join(["defshade", *sys.argv[1:]])
    level = "INFO" if reporting.verbose else "WARNING"
    limits = Limits(reporting.memory_limit, reporting.timeout)
    frames = max(1, len(job.frames))
    with (
        ended_by_sigterm(),
        make_progress(reporting, frames) as progress,
        Tally([job], reporting) as tally,
        leaving_no_leftovers([job]),
        LocalEngine(1, command=command, log_level=level, limits=limits) as engine,
    ):
        engine.submit(Chunk(job))
        for outcome in engine.outcomes():
            tally.add(outcome)
            if outcome.error:
                raise ContainedError(outcome.error, outcome.exit_code)
            progress.frame(outcome)
            for path in outcome.paths:
                click.echo(path)
