"""`defshade doctor`."""

from __future__ import annotations

import ctypes
import platform
from collections.abc import Iterator
from importlib import metadata

import click

from defshade_cli import __version__
from defshade_cli.cli.options import epilog
from defshade_cli.errors import GpuError

_PACKAGES = ("moderngl", "usd-core", "OpenImageIO", "numpy", "scipy", "colour-science", "click", "rich")


@click.command(epilog=epilog("defshade doctor"))
@click.pass_context
def doctor(context: click.Context) -> None:
    """Show what this machine can render with.

    Versions, libraries and graphics devices, and the command that installs what is missing. Ends with 4 where there is no graphics device that can render.
    """
    from defshade_cli.gpu.context import INSTALL_HINT, describe_devices

    click.echo(f"defshade     {__version__} on Python {platform.python_version()}, {platform.platform()}")
    click.echo(f"packages     {', '.join(_package_versions())}")
    click.echo(f"colour       {_colour_config()}")
    for line in _libraries():
        click.echo(f"library      {line}")
    devices = describe_devices()
    for device in devices:
        state = f"{device.renderer}, {device.vendor}, OpenGL {device.version}" if device.ok else device.problem
        click.echo(f"device {device.index}     {state}")
    if not any(device.ok for device in devices):
        click.echo(f"no device can render; on Debian or Ubuntu:\n\n    {INSTALL_HINT}\n", err=True)
        context.exit(GpuError.exit_code)


def _package_versions() -> Iterator[str]:
    for name in _PACKAGES:
        try:
            yield f"{name} {metadata.version(name)}"
        except metadata.PackageNotFoundError:
            yield f"{name} missing"


def _libraries() -> Iterator[str]:
    from defshade_cli.gpu.context import LIBEGL, LIBGL

    for name in (LIBEGL, LIBGL):
        try:
            ctypes.CDLL(name)
        except OSError as error:
            yield f"{name}: missing ({error})"
        else:
            yield f"{name}: found"


def _colour_config() -> str:
    """The OCIO configuration in force and its displays."""
    from defshade_cli.image.colour import displays

    return str(displays())
