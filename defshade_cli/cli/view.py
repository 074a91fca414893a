"""`defshade view`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from defshade_cli.cli.options import HeadedCommand, epilog
from defshade_cli.cli.types import Finite

if TYPE_CHECKING:
    from defshade_cli.cli.terminal import Form, Screen
    from defshade_cli.image.colour import DisplayTransform, Pixels
    from defshade_cli.image.stored import StoredImage

_EPILOG = epilog(
    "defshade view shot.exr",
    "defshade view shot.exr --layers depth --as blocks",
    "defshade view shot.exr --layers beauty,normal,depth",
    "defshade view shot.exr --html shot.html",
    "defshade view before.exr after.exr --html both.html",
)


@click.command(cls=HeadedCommand, epilog=_EPILOG)
@click.argument("images", metavar="IMAGE...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--layers",
    metavar="NAMES",
    help="Layers to show, with commas between, by their names in the file or in other renderers; 'all' for all. "
    "The default is the beauty, else the first there is; all in a page. Several are tiles of one picture.",
)
@click.option(
    "--as",
    "form",
    type=click.Choice(["auto", "kitty", "sixel", "blocks"]),
    default="auto",
    help="How the terminal draws; auto asks it, and takes half blocks where it knows no more.",
)
@click.option(
    "--html",
    "page",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.html",
    help="Write one page that needs no network: layers to switch, a slider for the exposure, values under the pointer.",
)
@click.option("--exposure", type=Finite(), default=0.0, metavar="STOPS", help="Stops that light is shown brighter by.")
@click.option("--ocio", metavar="CONFIG", default="", help="OCIO config; without it $OCIO's, else the built-in one.")
@click.option("--display", metavar="NAME", help="OCIO display.")
@click.option("--view", "ocio_view", metavar="NAME", help="OCIO view of the display.")
def view(
    images: Sequence[Path],
    layers: str | None,
    form: str,
    page: Path | None,
    exposure: float,
    ocio: str,
    display: str | None,
    ocio_view: str | None,
) -> None:
    """Look at IMAGEs: in the terminal, or as a page for a browser.

    EXR of any renderer and pictures. Light goes through the OCIO display and view; depth, ids, vectors and other data
    have the colours that the contact sheets of gbuffer --sheet have.
    """
    from defshade_cli.image.colour import display_transform
    from defshade_cli.image.stored import open_image

    shots = [
        (image, _names(image, layers, whole=page is not None), display_transform(display, ocio_view, space=image.space))
        for image in (open_image(path, ocio) for path in images)
    ]
    if page is not None:
        from defshade_cli.image.viewer import write_viewer

        write_viewer(shots, page, exposure)
        click.echo(page)
        return
    for image, names, transform in shots:
        _show(_brightened(image, exposure), names, transform, form)


def _names(image: StoredImage, asked: str | None, *, whole: bool) -> tuple[str, ...]:
    from defshade_cli.image.layers import BEAUTY

    if asked == "all" or (asked is None and whole):
        return tuple(image.layers)
    if asked is None:
        return (BEAUTY if BEAUTY in image.layers else next(iter(image.layers)),)
    return image.named(name.strip() for name in asked.split(","))


def _brightened(image: StoredImage, stops: float) -> StoredImage:
    """The image with its light scaled: colours alone, not their alpha."""
    import numpy as np

    if stops == 0.0:
        return image
    gain = np.array([2.0**stops] * 3 + [1.0], np.float32)
    colors = {
        name: pixels * gain[: pixels.shape[2]] for name, pixels in image.layers.items() if image.rows[name].is_color
    }
    return replace(image, layers=image.layers | colors)


def _show(image: StoredImage, names: tuple[str, ...], transform: DisplayTransform, form: str) -> None:
    """Draw on the terminal, over one line that says what it is."""
    from defshade_cli.cli.terminal import best_form, controlling_terminal, measure

    terminal = controlling_terminal()
    chosen = form if form != "auto" else "blocks" if terminal is None else best_form(terminal)
    picture = _picture(image, names, transform)
    click.echo(_drawn(picture, cast("Form", chosen), measure(terminal)), nl=False, color=True)
    others = [name for name in image.layers if name not in names]
    width, height = image.size
    click.echo(
        f"{image.path}  {width}x{height}  {', '.join(names)}" + (f"; also {', '.join(others)}" if others else "")
    )
    if terminal is not None:
        os.close(terminal)


def _picture(image: StoredImage, names: tuple[str, ...], transform: DisplayTransform) -> Pixels:
    """(H, W, 3) in [0, 1]: the layer, or several on a sheet."""
    from defshade_cli.image.look import look_at
    from defshade_cli.image.sheet import contact_sheet

    looks = {
        name: look_at(image.rows[name], image.layers[name], transform, names=image.manifests.get(name, {}))
        for name in names
    }
    return looks[names[0]].colors if len(looks) == 1 else contact_sheet(looks)


def _drawn(colors: Pixels, form: Form, screen: Screen) -> str:
    """The picture as text, reduced until it fits with two lines to spare."""
    from defshade_cli.image import terminal
    from defshade_cli.image.sizes import fitted

    width, height = screen.cell
    rows = max(1, screen.rows - 2)
    if form == "blocks":
        return terminal.blocks(fitted(colors, screen.columns, 2 * rows, pixel_aspect=height / 2 / width))
    fitting = fitted(colors, screen.columns * width, rows * height)
    return terminal.kitty(fitting) if form == "kitty" else terminal.sixel(fitting)
