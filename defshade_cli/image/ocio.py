"""OpenColorIO configs, as OpenImageIO reads them.

A config is named by its file, or as `ocio://default` by what OpenColorIO has built in. No name stands for $OCIO's, else
OpenImageIO's built-in ACES one.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.errors import UsageError
from defshade_cli.image.render_space import LINEAR_REC709, Matrix3, RenderSpace


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
