"""What the image is of, and how it is made."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import click

from defshade_cli import settings
from defshade_cli.cli.names import Layers
from defshade_cli.cli.options.option import Function, Option
from defshade_cli.cli.options.sampling import sampling_options
from defshade_cli.cli.types import Crop, Finite, Positive, Ranks, Size, Whole
from defshade_cli.settings import RenderSettings

_RENDER = RenderSettings()


def image_options(layers: Sequence[str] = ()) -> list[Function]:
    """Under the heading Image. layers: written when the user names none."""
    option = functools.partial(click.option, cls=Option, heading="Image")
    return [
        *size_options(),
        option(
            "--crop",
            type=Crop(),
            metavar="WxH+X+Y",
            help="Part of the image to render: WxH pixels from X, Y on, from the top left; what lies beyond the image "
            "is overscan. The default is the stage's data window.",
        ),
        option(
            "--layers",
            type=Layers(),
            metavar="NAMES",
            default=tuple(layers) or None,
            default_text=",".join(layers) or "what the stage's product names, else beauty",
            help="Layers to write, with commas between, of those listed below or by their names in Hydra, "
            "Arnold and Blender; 'all' for all that are listed.",
        ),
        option(
            "--cryptomatte-levels",
            type=Ranks(),
            default=_RENDER.cryptomatte_levels,
            default_text=str(_RENDER.cryptomatte_levels),
            metavar="N",
            help="Ids that a pixel of a Cryptomatte holds, the greatest coverage first: an even number up to 16.",
        ),
        *sampling_options(),
        *_shading_options(),
    ]


def size_options() -> list[Function]:
    """Under the heading Image: they exclude each other."""
    option = functools.partial(click.option, cls=Option, heading="Image")
    return [
        option(
            "--size",
            type=Size(),
            metavar="WxH",
            help="Size in pixels. The default is the stage's render settings, then 1920x1080.",
        ),
        option(
            "--width",
            type=Whole(min=1),
            metavar="PIXELS",
            help="Width in pixels; the height follows the camera's aspect.",
        ),
    ]


def _shading_options() -> list[Function]:
    option = functools.partial(click.option, cls=Option, heading="Image")
    return [
        option(
            "--shading",
            type=click.Choice(settings.SHADINGS),
            default=_RENDER.shading,
            default_text=str(_RENDER.shading),
            help="Lighting equation: UsdPreviewSurface's, or the classic one of deferred renderers.",
        ),
        option(
            "--shadows/--no-shadows",
            default=_RENDER.shadows,
            default_text="--shadows",
            help="Whether geometry hides lights.",
        ),
        option(
            "--background/--no-background",
            default=_RENDER.background,
            default_text="--background",
            help="Whether dome lights are seen behind the geometry.",
        ),
        option(
            "--gbuffer",
            "layout",
            type=click.Choice(settings.LAYOUTS),
            default=_RENDER.layout,
            default_text=str(_RENDER.layout),
            help="Encoding of the GBuffer that lighting reads; data layers are always read as float.",
        ),
        option(
            "--complexity",
            type=click.Choice(settings.COMPLEXITIES),
            default=_RENDER.complexity,
            default_text=str(_RENDER.complexity),
            help="Refinement of subdivision surfaces: auto goes by their size in the image; low draws their cages, "
            "medium, high and veryhigh one, two and three levels. All but auto draw solids, points and curves as "
            "usdrecord does: of ten segments, as disks, and as lines or ribbons.",
        ),
        option(
            "--light-tolerance",
            type=Positive(),
            metavar="VALUE",
            default=_RENDER.light_tolerance,
            default_text=f"{_RENDER.light_tolerance:g}",
            help="Scene-linear light that a pixel may lose in all where lights are taken to end; more makes smaller "
            "volumes and faster frames.",
        ),
        option(
            "--lighting",
            type=click.Choice(settings.LIGHTINGS),
            default=_RENDER.lighting,
            default_text=str(_RENDER.lighting),
            help="Lights as volumes that are blended over the image, in lists by tiles of it, or all on the whole of "
            "it: the same picture. auto takes what is predicted to be cheapest.",
        ),
        option(
            "--debug",
            type=click.Choice(settings.DEBUGS),
            help="Draw over the beauty: volumes are the shapes around the lights' reach, each in a colour; what fills "
            "the image is a frame.",
        ),
        option(
            "--render-space",
            metavar="NAME",
            help="Scene-linear colour space that light and reflectance meet in, and that EXR holds: lin_rec709, ACEScg "
            "or another of the OCIO config's. The default is the stage's render settings, then lin_rec709.",
        ),
        option(
            "--ocio",
            metavar="CONFIG",
            default=_RENDER.ocio,
            default_text="$OCIO, else ocio://default",
            help="OCIO config: a file, or ocio://NAME for one that OpenColorIO has built in.",
        ),
        option(
            "--exposure",
            type=Finite(),
            metavar="STOPS",
            default=_RENDER.exposure,
            default_text=str(_RENDER.exposure),
            help="Stops added to the camera's exposure.",
        ),
    ]
