"""The options that commands share, and the frozen job that they become."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

from defshade_cli import settings
from defshade_cli.cli.types import Finite, Frames, Names, Size
from defshade_cli.errors import UsageError
from defshade_cli.image.layers import LAYERS
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

PROGRESS = ("auto", "bar", "alf", "openjd", "json", "none")

_RENDER, _OUTPUT = RenderSettings(), OutputSettings()
Function = Callable[..., Any]


@dataclass(frozen=True, slots=True)
class Reporting:
    """How a command speaks while it works. stats: file of the record, None for none."""

    progress: str = "auto"
    stats: Path | None = None
    quiet: bool = False
    verbose: bool = False


class Option(click.Option):
    """An option that knows the heading it stands under in `--help`, and says its default in our own words."""

    def __init__(self, *args: Any, heading: str, default_text: str = "", **kwargs: Any) -> None:
        if default_text:
            kwargs["help"] += f"  [default: {default_text}]"
        super().__init__(*args, **kwargs)
        self.heading = heading


class HeadedCommand(click.Command):
    """A command whose `--help` groups the options under their headings."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        sections: dict[str, list[tuple[str, str]]] = {}
        for param in self.get_params(ctx):
            record = None if isinstance(param, click.Argument) else param.get_help_record(ctx)
            if record is not None:
                sections.setdefault(getattr(param, "heading", "Options"), []).append(record)
        for heading, records in sections.items():
            with formatter.section(heading):
                formatter.write_dl(records)


def takes_stage(function: Function) -> Function:
    """Give a command the options of stage and image: it is called with a RenderJob and its own keywords."""
    return _takes([_scene_argument(), *_stage_options(), *_image_options(_RENDER.layers)], function)


def takes_job(*, layers: Sequence[str] = _RENDER.layers, name: str = "{scene}") -> Callable[[Function], Function]:
    """Give a command every option of a render: it is called with a RenderJob and a Reporting.

    layers: written when the user names none.  name: of the output, without frame and suffix, likewise.
    """

    def decorate(function: Function) -> Function:
        @functools.wraps(function)
        def command(job: RenderJob, **values: Any) -> Any:
            return function(with_output(job, name), Reporting(**take(values, Reporting)), **values)

        return _takes([_scene_argument(), *render_options(layers, name)], command)

    return decorate


def render_options(layers: Sequence[str] = _RENDER.layers, name: str = "{scene}") -> list[Function]:
    """Every option of a render, with the defaults that takes_job tells of."""
    return [*_stage_options(), *_image_options(layers), *_output_options(name), *_run_options()]


def epilog(*examples: str, layers: bool = False) -> str:
    r"""What stands below a command's options: examples, the table of layers. \b keeps click from wrapping."""
    paragraphs = ["\b\nExamples:\n" + "\n".join(f"  {example}" for example in examples)]
    if layers:
        lines = (f"  {name:<11}{''.join(layer.channels):<6}{layer.summary}" for name, layer in LAYERS.items())
        paragraphs.append("\b\nLayers:\n" + "\n".join(lines))
    return "\n\n".join(paragraphs)


def _takes(options: list[Function], function: Function) -> Function:
    @functools.wraps(function)
    def command(**values: Any) -> Any:
        job = make_job(values)
        return function(job, **values)

    for option in reversed(options):
        command = option(command)
    return command


def make_job(values: dict[str, Any]) -> RenderJob:
    """The RenderJob in a command's `values`, which keep only what is the command's own."""
    if values["size"] and values["width"]:
        raise UsageError("--size and --width exclude each other")
    if values["frames"] and values["default_time"]:
        raise UsageError("--frames and --default-time exclude each other")
    default_time = values.pop("default_time")
    values["frames"] = (None,) if default_time else values["frames"] or ()
    return RenderJob(
        stage=values.pop("scene"),
        settings=RenderSettings(**take(values, RenderSettings)),
        output=OutputSettings(**take(values, OutputSettings)),
        **take(values, RenderJob),
    )


def take(values: dict[str, Any], owner: Any) -> dict[str, Any]:
    """Those of `values` that are fields of the dataclass `owner`, removed from `values`."""
    return {name: values.pop(name) for name in owner.__dataclass_fields__ if name in values}


def with_output(job: RenderJob, name: str) -> RenderJob:
    """`job` with the default file name where the user gave none."""
    patterns = job.output.patterns or (f"{name}.####.exr" if len(job.frames) > 1 else f"{name}.exr",)
    return replace(job, output=replace(job.output, patterns=patterns))


def _scene_argument() -> Function:
    return click.argument("scene", type=click.Path(path_type=Path))


def _stage_options() -> list[Function]:
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


def _image_options(layers: Sequence[str]) -> list[Function]:
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
            type=click.IntRange(min=1),
            metavar="PIXELS",
            help="Width in pixels; the height follows the camera's aspect.",
        ),
        option(
            "--samples",
            type=click.IntRange(min=1),
            default=_RENDER.samples,
            default_text=str(_RENDER.samples),
            metavar="N",
            help="Samples a pixel of the beauty: places in the pixel, on the lens and on every light. One sample takes "
            "lights for points. Data layers are one sample at the pixel's centre.",
        ),
        option(
            "--layers",
            type=Names("layer", tuple(LAYERS)),
            metavar="NAMES",
            default=tuple(layers),
            default_text=",".join(layers),
            help="Layers to write, with commas between, of those listed below; or 'all'.",
        ),
        *_shading_options(),
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
            "medium, high and veryhigh one, two and three levels.",
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


def _output_options(name: str) -> list[Function]:
    option = functools.partial(click.option, cls=Option, heading="Output")
    return [
        option(
            "-o",
            "--output",
            "patterns",
            multiple=True,
            metavar="FILE",
            default_text=f"{name}.exr; {name}.####.exr for several frames",
            help="File to write, repeatable; the suffix picks the format. "
            "Tokens: {scene}, {camera}, and the frame as ####, %04d or $F4.",
        ),
        option(
            "--existing",
            type=click.Choice(settings.EXISTING),
            default=_OUTPUT.existing,
            default_text=str(_OUTPUT.existing),
            help="What to do with a file that is there already.",
        ),
        option(
            "--float",
            "full_float",
            is_flag=True,
            help="32-bit channels in EXR for light and reflectance too; all else is 32-bit always.",
        ),
        option(
            "--compression",
            type=click.Choice(settings.COMPRESSIONS),
            default=_OUTPUT.compression,
            default_text=str(_OUTPUT.compression),
            help="Compression of EXR.",
        ),
        option("--split-layers", is_flag=True, help="One file a layer in place of one file with all."),
        option("--display", metavar="NAME", help="OCIO display for formats such as PNG, not for EXR."),
        option("--view", metavar="NAME", help="OCIO view of the display."),
    ]


def _run_options() -> list[Function]:
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
