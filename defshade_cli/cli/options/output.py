"""How an image becomes files."""

from __future__ import annotations

import functools

import click

from defshade_cli import settings
from defshade_cli.cli.names import file_completion
from defshade_cli.cli.options.option import Function, Option
from defshade_cli.cli.types import OneOf
from defshade_cli.settings import OutputSettings

_OUTPUT = OutputSettings()


def output_options(name: str) -> list[Function]:
    """Under the heading Output. name: of the file when the user gives none, without frame and suffix."""
    option = functools.partial(click.option, cls=Option, heading="Output")
    return [
        option(
            "-o",
            "--output",
            "patterns",
            multiple=True,
            metavar="FILE",
            shell_complete=file_completion,
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
        option(
            "--sheet",
            is_flag=True,
            help="One picture with all layers as labelled tiles, data in false colour with a legend.",
        ),
        option("--split-layers", is_flag=True, help="One file a layer in place of one file with all."),
        option("--multipart", is_flag=True, help="One part a layer inside the EXR."),
        option("--tiled", is_flag=True, help="EXR in tiles in place of scanlines."),
        option("--mipmaps", is_flag=True, help="EXR in tiles, with all smaller levels."),
        option(
            "--bits",
            type=OneOf(settings.BITS),
            metavar="8|16",
            help="Bits a channel of pictures. The default is 16 for TIFF, 8 for the others.",
        ),
        option("--dither", is_flag=True, help="Dither the colours of 8-bit pictures, so that gradients show no bands."),
        option("--verify", is_flag=True, help="Read each file back and compare, before it takes its name."),
        option(
            "--on-nan",
            type=click.Choice(settings.ON_NAN),
            default=_OUTPUT.on_nan,
            default_text=str(_OUTPUT.on_nan),
            help="Where a value is NaN or infinite: end with exit code 5 once the frame is written, warn, or fill in "
            "the value of the nearest sound pixel. The log says which prim and light it comes from.",
        ),
        option("--display", metavar="NAME", help="OCIO display for formats such as PNG, not for EXR."),
        option("--view", metavar="NAME", help="OCIO view of the display."),
        option("--look", metavar="NAME", help="OCIO look, before the view."),
    ]
