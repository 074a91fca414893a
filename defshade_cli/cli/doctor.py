"""`defshade doctor`."""

from __future__ import annotations

import ctypes
import os
import platform
from collections.abc import Iterator
from importlib import metadata

import click

from defshade_cli import __version__
from defshade_cli.cli.options import epilog
from defshade_cli.errors import GpuError, UsageError

_PACKAGES = ("moderngl", "usd-core", "OpenImageIO", "numpy", "scipy", "colour-science", "click", "rich")


@click.command(epilog=epilog("defshade doctor"))
def doctor() -> None:
    """Show what this machine can render with.

    Versions, libraries and graphics devices, and the command that installs what is missing. Ends with 4 where no
    device can render.
    """
    from defshade_cli.gpu.context import describe_devices

    devices = describe_devices()
    click.echo(f"defshade  {__version__} on Python {platform.python_version()}, {platform.platform()}")
    click.echo(f"packages  {', '.join(_package_versions())}")
    click.echo(f"colour    {_colour_config()}")
    for line in _libraries():
        click.echo(f"library   {line}")
    for device in devices:
        state = f"{device.renderer}, {device.vendor}, OpenGL {device.version}" if device.ok else device.problem
        click.echo(f"device {device.index}  {state}")
    if not any(device.ok for device in devices):
        raise GpuError(f"no device can render: {devices[0].problem}")


def _package_versions() -> Iterator[str]:
    for name in _PACKAGES:
        try:
            yield f"{name} {metadata.version(name)}"
        except metadata.PackageNotFoundError:
            yield f"{name} missing"


def _colour_config() -> str:
    """Where the OCIO configuration is from, and what pictures are shown with by default."""
    from defshade_cli.image.colour import display_transform
    from defshade_cli.image.ocio import read_displays

    source = os.environ.get("OCIO", "OpenImageIO's built-in config")
    try:
        shown = display_transform()
        return f"{source}: {shown.display} / {shown.view} by default, {len(read_displays().views)} displays"
    except UsageError as error:
        return f"{source}: {error}"


def _libraries() -> Iterator[str]:
    from defshade_cli.gpu.context import LIBEGL, LIBGL

    for name in (LIBEGL, LIBGL):
        try:
            ctypes.CDLL(name)
        except OSError as error:
            yield f"{name}: missing ({error})"
        else:
            yield f"{name}: found"
