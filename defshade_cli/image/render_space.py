"""The render space: the scene-linear colour space that light and reflectance meet in."""

from __future__ import annotations

from defshade_cli.dataclass import dataclass

Matrix3 = tuple[tuple[float, ...], ...]

_IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
LINEAR_REC709 = "lin_rec709_scene"


@dataclass(frozen=True, slots=True)
class RenderSpace:
    """A scene-linear space of an OCIO config.

    name: as the config knows it.  interop_id: of the Color Interop Forum, for file headers; else the name.
    chromaticities: x and y of red, green, blue and white; None where the config does not tell.
    from_rec709: rows of the matrix that takes linear Rec.709, which scenes are in, to this space.
    config: the OCIO config's name; empty for $OCIO's or the built-in one.
    """

    name: str = LINEAR_REC709
    interop_id: str = LINEAR_REC709
    chromaticities: tuple[float, ...] | None = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # ITU-R BT.709-6
    from_rec709: Matrix3 = _IDENTITY
    config: str = ""

    @property
    def is_rec709(self) -> bool:
        """Scenes need no conversion."""
        return self.from_rec709 == _IDENTITY


REC709 = RenderSpace()
