"""How a command works, and speaks while it does."""

from __future__ import annotations

import functools
from pathlib import Path

import click

from defshade_cli.cli.options.option import Function, Option
from defshade_cli.cli.types import Whole
from defshade_cli.dataclass import dataclass

PROGRESS = ("auto", "bar", "alf", "openjd", "json", "none")


@dataclass(frozen=True, slots=True)
class Reporting:
    """How a command works and speaks.

    stats: file of the record, None for none.
    isolate: in a process of its own.  memory_limit: MiB of that process.  timeout: seconds that a frame may take it.
    """

    progress: str = "auto"
    stats: Path | None = None
    quiet: bool = False
    verbose: bool = False
    isolate: bool = False
    memory_limit: int | None = None
    timeout: float | None = None

    @property
    def contained(self) -> bool:
        """Whether the render goes into a process of its own, which a limit can end."""
        return self.isolate or self.memory_limit is not None or self.timeout is not None


def device_option(heading: str) -> Function:
    """Which graphics device draws."""
    return click.option(
        "--device",
        cls=Option,
        heading=heading,
        type=Whole(min=0),
        metavar="N",
        help="Graphics device, by its index in 'defshade doctor'.",
    )


def run_options() -> list[Function]:
    """Under the heading Run."""
    option = functools.partial(click.option, cls=Option, heading="Run")
    return [
        device_option("Run"),
        option(
            "--stats",
            type=click.Path(dir_okay=False, path_type=Path),
            metavar="FILE",
            help="Write settings, seconds, decisions and statistics of the layers as JSON.",
        ),
        option(
            "--progress",
            type=click.Choice(PROGRESS),
            default="auto",
            default_text="auto",
            help="How to tell progress on stderr: auto is a bar on a terminal and else a line a frame, "
            "alf is Tractor's, openjd Open Job Description's.",
        ),
        option(
            "--isolate",
            is_flag=True,
            help="Render in a process of its own, so that a crash of a library is an error; batch always does.",
        ),
        option(
            "--memory-limit",
            type=Whole(min=1),
            metavar="MIB",
            help="Give a frame up whose process holds more memory than this; implies --isolate.",
        ),
        option(
            "--timeout",
            type=click.FloatRange(min=0.0, min_open=True),
            metavar="SECONDS",
            help="Give a frame up that takes longer than this, reading and writing included; implies --isolate.",
        ),
        option("-q", "--quiet", is_flag=True, help="No progress, no warnings: results and errors only."),
        option("-v", "--verbose", is_flag=True, help="Log what is done and decided."),
    ]
