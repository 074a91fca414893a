"""A camera and lights of ours, for stages that have none or others than are wanted."""

from __future__ import annotations

import functools

import click

from defshade_cli.cli.names import Direction
from defshade_cli.cli.options.option import Function, Option
from defshade_cli.cli.types import Whole


def framing_options() -> list[Function]:
    """Under the heading Stage."""
    option = functools.partial(click.option, cls=Option, heading="Stage")
    return [
        option(
            "--fit",
            is_flag=True,
            help="Look at all of the stage with a camera of ours, whatever cameras it has.",
        ),
        option(
            "--turntable",
            type=Whole(min=1),
            metavar="N",
            help="Go around all of the stage once in N frames, which are 1 to N. --frames picks some of them.",
        ),
        option(
            "--direction",
            type=Direction(),
            metavar="NAME|AZIMUTH,ELEVATION",
            default_text="30,20",
            help="Where --fit looks from and --turntable begins: front, back, left, right, top, bottom, or degrees "
            "from the front towards +X, and upwards.",
        ),
        option(
            "--studio",
            is_flag=True,
            help="Light a stage that has no light with three softboxes and a dome that turn with the camera, in place "
            "of one light at the camera.",
        ),
    ]
