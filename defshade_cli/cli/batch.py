"""`defshade batch`."""

from __future__ import annotations

import functools
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from defshade_cli.cli.arguments import option_arguments
from defshade_cli.cli.ending import ended_by_sigterm
from defshade_cli.cli.jobfile import JOB_SUFFIXES, read_job_file
from defshade_cli.cli.options import (
    Function,
    HeadedCommand,
    Option,
    Reporting,
    epilog,
    make_job,
    render_options,
    take,
    with_output,
)
from defshade_cli.cli.progress import frame_name, make_progress, start_logging
from defshade_cli.cli.table import BatchTable
from defshade_cli.cli.tally import Tally
from defshade_cli.cli.types import Amount, Whole
from defshade_cli.dataclass import dataclass
from defshade_cli.errors import BatchError, UsageError
from defshade_cli.settings import RenderJob

if TYPE_CHECKING:
    from defshade_cli.farm.dask import DaskEngine
    from defshade_cli.farm.local import LocalEngine
    from defshade_cli.farm.tasks import Chunk

_EPILOG = epilog(
    "defshade batch shots/*.usda --frames 1:240 -o 'renders/{scene}/{scene}.####.exr'",
    "defshade batch nightly.yaml --existing skip --retries 2 --stats nightly.json",
    "defshade batch nightly.yaml --samples 1 --dry-run",
    "defshade batch nightly.yaml --emit openjd > job.yaml",
    "defshade batch nightly.yaml --engine dask --scheduler tcp://farm:8786 --resource GPU=1",
)


@dataclass(frozen=True, slots=True)
class Schedule:
    """How a batch is spread. workers, chunk: None is for the scheduler to say."""

    workers: int | None
    chunk: int | None
    retries: int
    keep_going: bool
    dry_run: bool
    emit: str | None
    engine: str
    scheduler: str | None
    resources: tuple[tuple[str, float], ...]
    report: Path | None


def _takes_jobs(function: Function) -> Function:
    """Call `function` with the RenderJobs of the arguments, a Reporting and a Schedule."""

    @functools.wraps(function)
    def command(sources: tuple[Path, ...], **values: Any) -> Any:
        reporting, schedule = Reporting(**take(values, Reporting)), Schedule(**take(values, Schedule))
        context = click.get_current_context()
        shots = [shot for source in sources for shot in _shots(source, context)]
        jobs = [with_output(make_job(values | shot | {"given": frozenset(shot)}), "{scene}") for shot in shots]
        return function(jobs, reporting, schedule)

    argument = click.argument(
        "sources", nargs=-1, required=True, metavar="SCENE|JOB.yaml...", type=click.Path(path_type=Path)
    )
    for option in reversed([argument, *render_options(), *_batch_options()]):
        command = option(command)
    return command


def _shots(source: Path, context: click.Context) -> list[dict[str, Any]]:
    """Option values, one set for each stage and camera that an argument stands for."""
    return read_job_file(source, context) if source.suffix in JOB_SUFFIXES else [{"scene": source}]


def _batch_options() -> list[Function]:
    option = functools.partial(click.option, cls=Option, heading="Batch")
    return [
        option(
            "--workers",
            type=Whole(min=1),
            metavar="N",
            default_text="one a core, as memory allows",
            help="Worker processes.",
        ),
        option(
            "--chunk",
            type=Whole(min=1),
            metavar="N",
            default_text="a quarter of a worker's share, at most 16",
            help="Frames of a stage that a worker takes at a time.",
        ),
        option(
            "--retries",
            type=Whole(min=0),
            metavar="N",
            default=1,
            default_text="1",
            help="How often a frame that failed is rendered again.",
        ),
        option(
            "--report",
            type=click.Path(dir_okay=False, path_type=Path),
            metavar="FILE.html",
            help="Write a page of all frames with thumbnails, times and logs, and its record as JSON beside it.",
        ),
        option(
            "--keep-going/--fail-fast",
            default=True,
            default_text="--keep-going",
            help="Whether the other frames are rendered after one has failed for good.",
        ),
        option(
            "--engine",
            type=click.Choice(["local", "dask"]),
            default="local",
            default_text="local",
            help="Where frames are rendered: processes of this machine, or a Dask cluster.",
        ),
        option(
            "--scheduler",
            metavar="ADDRESS",
            default_text="a cluster on this machine",
            help="Dask's scheduler to join, such as tcp://farm:8786.",
        ),
        option(
            "--resource",
            "resources",
            type=Amount(),
            multiple=True,
            metavar="NAME=N",
            help="What a Dask worker must have to spare for a chunk, such as GPU=1; repeatable.",
        ),
        option("--dry-run", is_flag=True, help="Print the tasks and render nothing."),
        option(
            "--emit",
            type=click.Choice(["openjd"]),
            help="Print the batch as an Open Job Description template, for a farm to render.",
        ),
    ]


@click.command(cls=HeadedCommand, epilog=_EPILOG)
@_takes_jobs
def batch(jobs: Sequence[RenderJob], reporting: Reporting, schedule: Schedule) -> None:
    """Render many stages over many frames, in worker processes.

    The arguments are USD stages and job files; options that are given count for both. A worker that crashes costs the
    frame at work. The paths of the files go to stdout, one a line; a summary ends the batch, and exit code 6 says that
    some frame failed.
    """
    from defshade_cli.farm.local import default_workers
    from defshade_cli.farm.tasks import check_batch, chunk_size, frame_count, make_chunks

    if schedule.engine != "dask" and (schedule.scheduler or schedule.resources):
        raise UsageError("--scheduler and --resource are for --engine dask")
    if schedule.engine == "dask" and (reporting.memory_limit or reporting.timeout):
        raise UsageError("--memory-limit and --timeout are for --engine local")
    start_logging(reporting)
    check_batch(jobs)
    frames = frame_count(jobs)
    workers = schedule.workers or default_workers(frames)
    chunks = make_chunks(jobs, schedule.chunk or chunk_size(frames, workers))
    if schedule.emit:
        _emit(jobs)
    elif schedule.dry_run:
        for chunk in chunks:
            click.echo(_task_line(chunk))
    else:
        with ended_by_sigterm():
            _render(jobs, chunks, workers, reporting, schedule)


def _render(
    jobs: Sequence[RenderJob], chunks: Sequence[Chunk], workers: int, reporting: Reporting, schedule: Schedule
) -> None:
    from defshade_cli.farm.batch import run_batch
    from defshade_cli.farm.tasks import frame_count, leaving_no_leftovers

    tally = Tally(jobs, reporting, schedule.report)
    with make_progress(reporting, frame_count(jobs), BatchTable) as progress, tally:
        with leaving_no_leftovers(jobs), _make_engine(workers, reporting, schedule) as engine:
            for outcome in run_batch(chunks, engine, retries=schedule.retries, keep_going=schedule.keep_going):
                tally.add(outcome)
                if outcome.error:
                    progress.frame_failed(outcome)
                    continue
                progress.frame(outcome)
                for path in outcome.paths:
                    click.echo(path)
        if tally.failures:
            raise BatchError(tally.verdict)


def _make_engine(workers: int, reporting: Reporting, schedule: Schedule) -> LocalEngine | DaskEngine:
    from defshade_cli.farm.dask import DaskEngine
    from defshade_cli.farm.limits import Limits
    from defshade_cli.farm.local import LocalEngine

    level = "INFO" if reporting.verbose else "WARNING"
    command = shlex.join(["defshade", *sys.argv[1:]])
    if schedule.engine == "local":
        limits = Limits(reporting.memory_limit, reporting.timeout)
        return LocalEngine(workers, command=command, log_level=level, limits=limits)
    resources = dict(schedule.resources)
    engine = DaskEngine(schedule.scheduler, workers, resources=resources, command=command, log_level=level)
    if not reporting.quiet:
        click.echo(f"Dask's dashboard: {engine.dashboard}", err=True)
    return engine


def _emit(jobs: Sequence[RenderJob]) -> None:
    import yaml

    from defshade_cli.farm.openjd import make_template

    params = click.get_current_context().command.params
    template = make_template((job, option_arguments(job, params)) for job in jobs)
    click.echo(yaml.safe_dump(template, sort_keys=False, width=110), nl=False)


def _task_line(chunk: Chunk) -> str:
    job = chunk.job
    frames = ",".join(frame_name(frame) for frame in job.frames) or "first frame"
    camera = f"  camera {job.camera}" if job.camera else ""
    return f"{job.stage}{camera}  frames {frames}  → {', '.join(job.output.patterns or (job.output.fallback,))}"
