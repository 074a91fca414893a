"""How a command works, and speaks while it does."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

import click

from defshade_cli.cli.options.option import Function, Option

PROGRESS = ("auto", "bar", "alf", "openjd", "json", "none")


@dataclass(frozen=True, slots=True)
class Reporting:
    """How a command speaks while it works. stats: file of the record, None for none."""

    progress: str = "auto"
    stats: Path | None = None
    quiet: bool = False
    verbose: bool = False


def run_options() -> list[Function]:
    """Under the heading Run."""
    option = functools.partial(click.option, cls=Option, heading="Run")
    return [
        option(
            "--device",
            type=click.IntRange(min=0),
            metavar="N",
            help="Graphics device, by its index in 'defshade doctor'.",
        ),
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
        option("-q", "--quiet", is_flag=True, help="No progress, no warnings: results and errors only."),
        option("-v", "--verbose", is_flag=True, help="Log what is done and decided."),
    ]
