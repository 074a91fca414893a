"""The render space: the scene-linear colour space that light and reflectance meet in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.errors import UsageError
from defshade_cli.image.ocio import linear_spaces, open_config

Matrix3 = tuple[tuple[float, ...], ...]

_IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_REC709 = "lin_rec709_scene"


@dataclass(frozen=True, slots=True)
class RenderSpace:
    """A scene-linear space of an OCIO config.

    name: as the config knows it.  interop_id: of the Color Interop Forum, for file headers; else the name.
    chromaticities: x and y of red, green, blue and white; None where the config does not tell.
    from_rec709: rows of the matrix that takes linear Rec.709, which scenes are in, to this space.
    config: the OCIO config's name; empty for $OCIO's or the built-in one.
    """

    name: str = _REC709
    interop_id: str = _REC709
    chromaticities: tuple[float, ...] | None = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # ITU-R BT.709-6
    from_rec709: Matrix3 = _IDENTITY
    config: str = ""

    @property
    def is_rec709(self) -> bool:
        """Scenes need no conversion."""
        return self.from_rec709 == _IDENTITY


REC709 = RenderSpace()


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
    moved = oiio.ImageBufAlgo.colorconvert(primaries, _REC709, space, unpremult=False, colorconfig=config)
    if moved.has_error:
        raise UsageError(f"the OCIO config cannot take {_REC709} to '{space}': {moved.geterror()}")
    columns: NDArray = np.asarray(moved.get_pixels(oiio.FLOAT))[0]
    rounded = np.where(np.isclose(columns, np.eye(3), atol=1e-6), np.eye(3), columns)
    return tuple(tuple(float(value) for value in row) for row in rounded.T)
