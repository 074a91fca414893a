"""`defshade bench`."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from defshade_cli import __version__, settings
from defshade_cli.cli.names import Names
from defshade_cli.cli.options import Function, HeadedCommand, Option, epilog, make_job, take
from defshade_cli.cli.options.image import size_options
from defshade_cli.cli.options.run import device_option
from defshade_cli.cli.options.stage import stage_options
from defshade_cli.cli.progress import show_log
from defshade_cli.cli.stats import plain, write_record
from defshade_cli.cli.types import Counts, Positive, Whole
from defshade_cli.errors import UsageError
from defshade_cli.image.appearing import write_text
from defshade_cli.settings import RenderJob

if TYPE_CHECKING:
    from defshade_cli.measure.bench import Bench, Cost, Sweep, Trial

_COSTS = ("wall", "cpu")
_SHADOWS = {"both": (True, False), "on": (True,), "off": (False,)}

_EPILOG = epilog(
    "defshade bench shot.usd --width 480",
    "defshade bench shot.usd --max-error 0.001 --cost cpu",
    "defshade bench shots/*.usd --layouts float --samples 1,16,256 --shadows on --json bench.json",
    "defshade bench shot.usd --reference truth.exr --plot bench.svg",
)


def _bench_options() -> list[Function]:
    option = functools.partial(click.option, cls=Option, heading="Bench")
    file = click.Path(dir_okay=False, path_type=Path)
    return [
        *size_options(),
        option(
            "--layouts",
            type=Names("layout", settings.LAYOUTS),
            default="all",
            default_text=",".join(settings.LAYOUTS),
            metavar="NAMES",
            help="Encodings of the GBuffer to try, with commas between.",
        ),
        option(
            "--samples",
            type=Counts(),
            default="1,4,16,64",
            default_text="1,4,16,64",
            metavar="NUMBERS",
            help="Samples a pixel to try, with commas between.",
        ),
        option(
            "--shadows",
            type=click.Choice(tuple(_SHADOWS)),
            default="both",
            default_text="both",
            help="Whether to try with shadows, without, or both where the stage has any.",
        ),
        option(
            "--filters",
            type=Names("filter", tuple(settings.FILTERS)),
            default="box",
            default_text="box",
            metavar="NAMES",
            help="Pixel filters to try, with commas between; each is held to a reference of its own.",
        ),
        option(
            "--rounds",
            type=Whole(min=1),
            metavar="N",
            default=3,
            default_text="3",
            help="How often each is timed, in turns with all others; the median counts.",
        ),
        option(
            "--reference",
            type=file,
            metavar="FILE",
            help="Scene-linear image to count errors against. The default is our own, converged, which is kept in "
            "$XDG_CACHE_HOME/defshade until stage or settings change.",
        ),
        option(
            "--reference-samples",
            type=Whole(min=1),
            metavar="N",
            default=1024,
            default_text="1024",
            help="Samples of our own reference, of float layout and with shadows.",
        ),
        option("--flip/--no-flip", default=True, default_text="--flip", help="Whether to measure FLIP: seconds each."),
        option(
            "--cost",
            type=click.Choice(_COSTS),
            default="wall",
            default_text="wall",
            help="What is cheap: seconds, or processor seconds, which other work on the machine disturbs less.",
        ),
        option(
            "--max-error",
            "most_error",
            type=Positive(),
            metavar="ERROR",
            help="Recommend the cheapest settings whose relMSE is no more than this.",
        ),
        option("--json", "json_file", type=file, metavar="FILE", help="Write all figures as JSON."),
        option(
            "--plot",
            "plot_file",
            type=file,
            metavar="FILE.svg",
            help="Draw run time against error; for several stages a file each, named by the stage.",
        ),
        device_option("Bench"),
        option("-q", "--quiet", is_flag=True, help="Do not tell what is at work."),
    ]


def _takes_stages(function: Function) -> Function:
    """Call `function` with the RenderJobs of the arguments, a Sweep and what else it asks for."""

    @functools.wraps(function)
    def command(scenes: tuple[Path, ...], **values: Any) -> Any:
        from defshade_cli.measure.bench import Sweep

        values["shadows"] = _SHADOWS[values["shadows"]]
        sweep = Sweep(**take(values, Sweep))
        own = {name: values.pop(name) for name in ("cost", "most_error", "json_file", "plot_file", "quiet")}
        jobs = [make_job(values | {"scene": scene}) for scene in scenes]
        return function(jobs, sweep, **own)

    argument = click.argument("scenes", nargs=-1, required=True, metavar="SCENE...", type=click.Path(path_type=Path))
    for option in reversed([argument, *stage_options(), *_bench_options()]):
        command = option(command)
    return command


@click.command(cls=HeadedCommand, epilog=_EPILOG)
@_takes_stages
def bench(
    jobs: Sequence[RenderJob],
    sweep: Sweep,
    cost: Cost,
    most_error: float | None,
    json_file: Path | None,
    plot_file: Path | None,
    quiet: bool,
) -> None:
    """Measure run time against error, for the settings that trade one for the other.

    Draws the first frame of each SCENE with every combination of layout, samples, shadows and filter, in alternating
    rounds, and compares each with the converged picture. What is timed is drawing alone: reading, start-up and output
    are the same for all. A star marks the Pareto front: what no other settings beat in both time and relMSE.
    """
    from defshade_cli.gpu.context import Gpu
    from defshade_cli.measure.bench import run_sweep
    from defshade_cli.passes.pipeline import Pipeline

    if plot_file is not None and plot_file.suffix.lower() != ".svg":
        raise UsageError(f"{plot_file}: plots are drawn as .svg")
    show_log()
    benches = []
    with Gpu(jobs[0].device) as gpu:
        pipeline = Pipeline(gpu)
        for job in jobs:
            found = run_sweep(pipeline, gpu.renderer, job, sweep, lambda line: _say(line, quiet))
            benches.append(found)
            _show(found, cost, most_error)
            if plot_file is not None:
                _write_plot(found, cost, plot_file if len(jobs) == 1 else _beside(plot_file, job.stage))
    if json_file is not None:
        record = {"version": __version__, "cost": cost, "stages": [_record(b, cost, most_error) for b in benches]}
        write_record(json_file, record)


def _show(bench: Bench, cost: Cost, most_error: float | None) -> None:
    from rich.console import Console

    from defshade_cli.measure.bench import cheapest_within

    console = Console(markup=False, highlight=False, soft_wrap=True)
    console.print(f"{bench.stage}  {bench.size[0]}x{bench.size[1]} on {bench.device}")
    console.print(_table(bench, cost))
    if most_error is None:
        return
    best = cheapest_within(bench.trials, most_error, cost)
    if best is None:
        console.print(f"nothing tried reaches a relMSE of {most_error:g}: try more --samples")
    else:
        console.print(f"the cheapest with a relMSE of at most {most_error:g}: {best.choice}")


def _table(bench: Bench, cost: Cost) -> Any:
    from rich.table import Table

    from defshade_cli.measure.bench import pareto_front

    front = pareto_front(bench.trials, cost)
    table = Table("", "settings", box=None)
    for column in ("wall s", "cpu s", "relMSE", "FLIP"):
        table.add_column(column, justify="right")
    for trial in sorted(bench.trials, key=lambda trial: trial.cost(cost)):
        table.add_row("*" if trial in front else "", str(trial.choice), *_figures(trial))
    return table


def _figures(trial: Trial) -> Iterator[str]:
    yield f"{trial.wall:.3f}"
    yield f"{trial.cpu:.3f}"
    yield f"{trial.rel_mse:.2e}"
    yield "" if trial.flip is None else f"{trial.flip:.4f}"


def _record(bench: Bench, cost: Cost, most_error: float | None) -> dict[str, Any]:
    from defshade_cli.measure.bench import cheapest_within, pareto_front

    front = pareto_front(bench.trials, cost)
    best = None if most_error is None else cheapest_within(bench.trials, most_error, cost)
    trials = [plain(trial) | {"on_front": trial in front} for trial in bench.trials]
    return plain(bench) | {"trials": trials, "recommended": plain(best.choice) if best else None}


def _write_plot(bench: Bench, cost: Cost, path: Path) -> None:
    from defshade_cli.measure.bench.plot import plot

    write_text(path, plot(bench, cost))


def _beside(path: Path, stage: Path) -> Path:
    return path.with_name(f"{path.stem}.{stage.stem}{path.suffix}")


def _say(line: str, quiet: bool) -> None:
    if not quiet:
        click.echo(line, err=True)
