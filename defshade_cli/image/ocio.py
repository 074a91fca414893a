"""OpenColorIO configs, as OpenImageIO reads them.

A config is named by its file, or as `ocio://default` by what OpenColorIO has built in. No name stands for $OCIO's, else
OpenImageIO's built-in ACES one.
"""

from __future__ import annotations

from functools import cache

import OpenImageIO as oiio

from defshade_cli.errors import UsageError


@cache
def open_config(name: str = "") -> oiio.ColorConfig:
    """Raises UsageError for a config that cannot be read."""
    config = oiio.ColorConfig(name) if name else oiio.ColorConfig()
    if reason := config.geterror():
        raise UsageError(f"the OCIO config cannot be used: {reason}")
    return config


def displays(name: str = "") -> dict[str, tuple[str, ...]]:
    """The config's displays, each with its views."""
    config = open_config(name)
    return {display: tuple(config.getViewNames(display)) for display in config.getDisplayNames()}


def linear_spaces(name: str = "") -> tuple[str, ...]:
    """The config's scene-linear colour spaces."""
    config = open_config(name)
    scene = (space for space in config.getColorSpaceNames() if not space.endswith("Display-referred"))
    return tuple(space for space in scene if config.isColorSpaceLinear(space))
