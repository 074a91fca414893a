"""How many samples a pixel gets, and where they fall."""

from __future__ import annotations

import functools

import click

from defshade_cli import settings
from defshade_cli.cli.options.option import Function, Option
from defshade_cli.cli.types import Positive, Whole
from defshade_cli.settings import RenderSettings

_RENDER = RenderSettings()
_WIDTHS = ", ".join(f"{width:g} for {name}" for name, width in settings.FILTERS.items())


def sampling_options() -> list[Function]:
    """Under the heading Image."""
    option = functools.partial(click.option, cls=Option, heading="Image")
    return [
        option(
            "--samples",
            type=Whole(min=1),
            default_text=f"1, and {settings.MOST_SAMPLES} with --max-error or --time-limit",
            metavar="N",
            help="Samples a pixel of the beauty: places in the pixel, on the lens and on every light. "
            "Data layers are one sample at the pixel's centre.",
        ),
        option(
            "--light-points",
            type=Whole(min=1),
            default=_RENDER.light_points,
            default_text=str(_RENDER.light_points),
            metavar="N",
            help="Points that large lights get where there are fewer samples, each with a shadow map; they share them. "
            "1 takes every light for a point.",
        ),
        option(
            "--max-error",
            type=Positive(),
            metavar="ERROR",
            help="End once 95 % of the image's tiles have this relative standard error, such as 0.01; --samples is the "
            "most that a pixel gets then. A tile that has it gets no more samples.",
        ),
        option(
            "--time-limit",
            type=Positive(),
            metavar="SECONDS",
            help="End a frame once it has been drawn for so long; --samples is the most that a pixel gets then.",
        ),
        option(
            "--filter",
            type=click.Choice(tuple(settings.FILTERS)),
            default=_RENDER.filter,
            default_text=_RENDER.filter,
            help="Pixel filter by which the samples of the beauty fall, from the second on.",
        ),
        option(
            "--filter-width",
            type=Positive(),
            metavar="PIXELS",
            default_text=_WIDTHS,
            help="Width of the filter, from end to end.",
        ),
        option(
            "--motion-blur/--no-motion-blur",
            default=_RENDER.motion_blur,
            default_text="--motion-blur",
            help="Whether several samples see the stage at as many times while the camera's shutter is open.",
        ),
    ]
