"""Image textures and how a material's inputs read them, in the terms of UsdUVTexture and UsdTransform2d."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace
from typing import Literal, Self

from defshade_cli.dataclass import dataclass
from defshade_cli.spaces import Matrix

ColorSpace = str
"""auto, sRGB, raw, or a colour space by its Color Interop ID, such as lin_ap1_scene."""

STATED_SPACES = ("auto", "sRGB", "raw")
"""What a UsdUVTexture may say."""

Wrap = Literal["black", "clamp", "repeat", "mirror", "useMetadata"]
Channel = Literal["r", "g", "b", "a", "rgb"]
Four = tuple[float, float, float, float]
Affine = tuple[tuple[float, float, float], tuple[float, float, float]]

IDENTITY: Affine = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
FIRST_UDIM = 1001


@dataclass(frozen=True, slots=True)
class ImageFile:
    """path: where it lies; of one inside a package, `package.usdz[wood.png]`, contents are its bytes."""

    path: str
    contents: bytes | None = field(default=None, compare=False, repr=False)


SeenFrom = Callable[[ImageFile], Matrix | None]
"""What tells (4, 4), for row vectors, from what an image shows to where it is in it; None where nothing says it.

Raises OSError with the reason.
"""


@dataclass(frozen=True, slots=True)
class Texture:
    """An image, or the tiles of a UDIM set.

    tiles: (number, file) each; UDIM numbers are 1001 + column + 10 · row, and a single image is 1001.
    wrap_s, wrap_t: outside [0, 1]; a UDIM set has none.
    """

    tiles: tuple[tuple[int, ImageFile], ...]
    udim: bool = False
    color_space: ColorSpace = "auto"
    wrap_s: Wrap = "useMetadata"
    wrap_t: Wrap = "useMetadata"


@dataclass(frozen=True, slots=True)
class TextureInput:
    """What feeds one input of a material: texel's channel · scale + bias, at texture_from_uv · (u, v, 1).

    channel: one letter fills all channels, to each of which scale and bias then apply.
    uv: primvar that holds the texture coordinates; empty for none, the affine's offset alone then counts.
    fallback: (u, v) on what lacks that primvar.
    A UDIM tile that is missing is black with alpha 0; where no file can be read, the material's own value stands.
    """

    texture: Texture
    channel: Channel = "rgb"
    scale: Four = (1.0, 1.0, 1.0, 1.0)
    bias: Four = (0.0, 0.0, 0.0, 0.0)
    uv: str = "st"
    texture_from_uv: Affine = IDENTITY
    fallback: tuple[float, float] = (0.0, 0.0)

    def at_fallback(self) -> Self:
        """The same as it is read everywhere on what lacks the primvar."""
        (a, b, x), (c, d, y) = self.texture_from_uv
        u, v = self.fallback
        return replace(self, uv="", texture_from_uv=((0.0, 0.0, a * u + b * v + x), (0.0, 0.0, c * u + d * v + y)))
