"""OpenColorIO configs: their displays and spaces.

A config is named by its file, or as `ocio://default` by what OpenColorIO has built in, which is the ACES one. No name
stands for $OCIO's, else for that. OpenImageIO takes four times as long to open one: only what converts by it does.
"""

from __future__ import annotations

import os
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.errors import UsageError
from defshade_cli.image.render_space import LINEAR_REC709, Matrix3, RenderSpace

if TYPE_CHECKING:
    import PyOpenColorIO as ocio

_DEFAULT, _BUILT_IN = "ocio://default", "ocio://cg-config-v4.0.0_aces-v2.0_ocio-v2.5"
"""What OpenImageIO takes for the default: its OpenColorIO may be older than the one beside it."""

_NAMED_AS_DISPLAY = "<USE_DISPLAY_NAME>"


@cache
def read_config(name: str = "") -> ocio.Config:
    """What a config says. Raises UsageError for one that cannot be read."""
    import PyOpenColorIO as ocio

    chosen = name or os.environ.get("OCIO") or _DEFAULT
    try:
        return ocio.Config.CreateFromFile(_BUILT_IN if chosen == _DEFAULT else chosen)
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        raise UsageError(f"the OCIO config cannot be used: {error}") from error


@cache
def open_config(name: str = "") -> oiio.ColorConfig:
    """The same for OpenImageIO. Raises UsageError for a config that cannot be read."""
    config = oiio.ColorConfig(name) if name else oiio.ColorConfig()
    if reason := config.geterror():
        raise UsageError(f"the OCIO config cannot be used: {reason}")
    return config


def displays(name: str = "") -> dict[str, tuple[str, ...]]:
    """The config's displays, each with its views. Raises UsageError for a config that cannot be read."""
    config = read_config(name)
    return {display: tuple(config.getViews(display)) for display in config.getDisplays()}


def encoding_of(display: str, view: str, name: str = "") -> str:
    """The colour space that pixels have which a view of a display shows."""
    space = str(read_config(name).getDisplayViewColorSpaceName(display, view))
    return display if space == _NAMED_AS_DISPLAY else space


def linear_spaces(name: str = "") -> tuple[str, ...]:
    """The config's scene-linear colour spaces."""
    config = open_config(name)
    scene = (space for space in config.getColorSpaceNames() if not space.endswith("Display-referred"))
    return tuple(space for space in scene if config.isColorSpaceLinear(space))


def find_render_space(name: str | None, config: str = "") -> RenderSpace:
    """The scene-linear space that a config knows by `name`, an alias or a role; None for linear Rec.709.

    Raises UsageError for a space that the config lacks, or one that is not linear.
    """
    if name is None:
        return RenderSpace(config=config)
    known = open_config(config)
    space = known.resolve(name)
    if space not in linear_spaces(config):
        raise UsageError(f"no scene-linear space '{name}'; the OCIO config has {', '.join(linear_spaces(config))}")
    chromaticities = known.get_chromaticities(space)
    return RenderSpace(
        name=space,
        interop_id=known.get_color_interop_id(space) or space,
        chromaticities=tuple(chromaticities) if chromaticities else None,
        from_rec709=_matrix(space, config),
        config=config,
    )


def _matrix(space: str, config: str) -> Matrix3:
    """What the config makes of the three primaries of Rec.709, as columns."""
    primaries = oiio.ImageBuf(np.eye(3, dtype=np.float32)[None])
    moved = oiio.ImageBufAlgo.colorconvert(primaries, LINEAR_REC709, space, unpremult=False, colorconfig=config)
    if moved.has_error:
        raise UsageError(f"the OCIO config cannot take {LINEAR_REC709} to '{space}': {moved.geterror()}")
    columns: NDArray[Any] = np.asarray(moved.get_pixels(oiio.FLOAT))[0]
    rounded = np.where(np.isclose(columns, np.eye(3), atol=1e-6), np.eye(3), columns)
    return tuple(tuple(float(value) for value in row) for row in rounded.T)
