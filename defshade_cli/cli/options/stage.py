"""What is read of a stage, and when."""

from __future__ import annotations

import functools

import click

from defshade_cli import settings
from defshade_cli.cli.options.option import Function, Option
from defshade_cli.cli.types import Frames, Names
from defshade_cli.settings import RenderSettings

_RENDER = RenderSettings()


def stage_options() -> list[Function]:
    """Under the heading Stage."""
    option = functools.partial(click.option, cls=Option, heading="Stage")
    return [
        option(
            "--camera",
            metavar="PATH|NAME",
            help="Camera to look through. The default is the stage's own choice, else a view of everything.",
        ),
        option(
            "--frames",
            type=Frames(),
            metavar="FRAMES",
            help="Time codes: 1:10x2,15 is 1 3 5 7 9 15. The default is the stage's first frame.",
        ),
        option("--default-time", is_flag=True, help="Read default values in place of a frame's."),
        option(
            "--purposes",
            type=Names("purpose", settings.PURPOSES),
            metavar="NAMES",
            default=_RENDER.purposes,
            default_text=",".join(_RENDER.purposes),
            help=f"Purposes to draw, with commas between, of: {', '.join(settings.PURPOSES)}.",
        ),
    ]
