"""What is read of a stage, and when."""

from __future__ import annotations

import functools
from pathlib import Path

import click

from defshade_cli import settings
from defshade_cli.cli.names import Names, PrimPaths, Variant
from defshade_cli.cli.options.framing import framing_options
from defshade_cli.cli.options.option import Function, Option
from defshade_cli.cli.types import Frames
from defshade_cli.settings import Composition

_COMPOSITION = Composition()


def stage_options() -> list[Function]:
    """Under the heading Stage."""
    option = functools.partial(click.option, cls=Option, heading="Stage")
    return [
        option(
            "--camera",
            metavar="PATH|NAME",
            help="Camera to look through. The default is the stage's own choice, else a view of everything.",
        ),
        *framing_options(),
        option(
            "--frames",
            type=Frames(),
            metavar="FRAMES",
            help="Time codes: 1:10x2,15 is 1 3 5 7 9 15. The default is the stage's first frame.",
        ),
        option(
            "--settings",
            "render_settings",
            metavar="PRIM",
            help="RenderSettings or RenderPass of the stage. The default is what the stage names, else the first below "
            "/Render.",
        ),
        option(
            "--product",
            metavar="PATH|NAME",
            help="The one product of the render settings to make. The default is all, or the first where -o has no "
            "{product}.",
        ),
        option("--default-time", is_flag=True, help="Read default values in place of a frame's."),
        option(
            "--purposes",
            type=Names("purpose", settings.PURPOSES),
            metavar="NAMES",
            default_text="the stage's render settings, else default,render",
            help=f"Purposes to draw, with commas between, of: {', '.join(settings.PURPOSES)}.",
        ),
        *_composition_options(),
    ]


def _composition_options() -> list[Function]:
    option = functools.partial(click.option, cls=Option, heading="Stage")
    return [
        option(
            "--variant",
            "variants",
            type=Variant(),
            multiple=True,
            metavar="PRIM{SET=NAME}",
            help="Choose a variant, over what the stage chooses; repeatable, in order: '/Car{color=red}'.",
        ),
        option(
            "--mask",
            type=PrimPaths(),
            metavar="PRIMS",
            help="Limit the stage to these prims, with commas between, and to what stands above and below them. What "
            "they refer to, such as materials, is there too, and a camera given by its path; lights are not, unless "
            "the mask names them.",
        ),
        option(
            "--session-layer",
            "session_layers",
            type=click.Path(path_type=Path),
            multiple=True,
            metavar="FILE",
            help="USD file laid over the stage; repeatable, the first is the strongest.",
        ),
        option(
            "--payloads",
            type=click.Choice(settings.PAYLOADS),
            default=_COMPOSITION.payloads,
            default_text=str(_COMPOSITION.payloads),
            help="Whether payloads are loaded.",
        ),
    ]
