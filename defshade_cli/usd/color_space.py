"""The colour spaces that attributes are authored in: metadata, ColorSpaceAPI, and what a stage declares.

A Scene is in linear Rec.709; values without a space are in it already, as in UsdPreviewSurface's and UsdLux's texts.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd, Vt

from defshade_cli.scene.texture import ColorSpace

_REC709 = Gf.ColorSpace(Gf.ColorSpaceNames.LinearRec709)
_SRGB = Gf.ColorSpace(Gf.ColorSpaceNames.SRGBRec709)

_OTHER_NAMES = {
    "none": "raw",
    "linear": "raw",
    "lin_rec709": "lin_rec709_scene",
    "lin_srgb": "lin_rec709_scene",
    "srgb_texture": "srgb_rec709_scene",
    "sRGB": "srgb_rec709_scene",
    "srgb": "srgb_rec709_scene",
    "gamma18": "g18_rec709_scene",
    "g18_rec709": "g18_rec709_scene",
    "gamma22": "g22_rec709_scene",
    "g22_rec709": "g22_rec709_scene",
    "gamma24": "g24_rec709_scene",
    "rec709_display": "g24_rec709_scene",
    "acescg": "lin_ap1_scene",
    "lin_ap1": "lin_ap1_scene",
    "g22_ap1": "g22_ap1_scene",
    "adobergb": "g22_adobergb_scene",
    "lin_adobergb": "lin_adobergb_scene",
    "srgb_displayp3": "srgb_p3d65_scene",
    "lin_displayp3": "lin_p3d65_scene",
}
"""MaterialX 1.38's and 1.39's standard spaces, and what exporters wrote before USD had names, by Color Interop IDs."""


def is_color(attribute: Usd.Attribute) -> bool:
    """Whether the attribute's role is colour."""
    return attribute.GetRoleName() == "Color"


def in_rec709(attribute: Usd.Attribute, value: Any) -> Any:
    """A colour that `attribute` holds, or an array of them, in linear Rec.709; as it is where it is in that already."""
    space = space_named(_name_of(attribute))
    return value if space is None or value is None else rec709_of(space, value)


def rec709_of(space: Gf.ColorSpace, value: Any) -> NDArray[np.float32]:
    """(..., 3 or more) whose first three channels go from `space` to linear Rec.709."""
    colors = np.array(value, np.float32)
    span = Vt.FloatArray.FromNumpy(np.ascontiguousarray(colors[..., :3]).ravel())
    space.ConvertRGBSpan(_REC709, span)
    colors[..., :3] = np.asarray(span).reshape(*colors.shape[:-1], 3)
    return colors


def texture_space(attribute: Usd.Attribute) -> ColorSpace:
    """What an image file's attribute says of its texels; `auto` where it says nothing, or a name that nobody knows."""
    name = _name_of(attribute)
    return texture_space_of(name) if name and is_known(name) else "auto"


def texture_space_of(name: str) -> ColorSpace:
    """The space of texels by a known name for it; `raw` for linear Rec.709 and for data."""
    space = space_named(name)
    if space is None:
        return "raw"
    return "sRGB" if space == _SRGB else str(space.GetName())


def space_named(name: str) -> Gf.ColorSpace | None:
    """None for linear Rec.709, for data, and for a name that nobody knows."""
    if not name or not is_known(name):
        return None
    space = Gf.ColorSpace(_OTHER_NAMES.get(name, name))
    return None if space == _REC709 or space.IsData() else space


def is_known(name: str) -> bool:
    """Whether the colour space has this name in USD, in MaterialX or in stages of old."""
    return name in _OTHER_NAMES or bool(Gf.ColorSpace.IsValid(name))


def unknown_space(attribute: Usd.Attribute) -> str:
    """The name that is said of the attribute and that nobody knows; empty where there is none."""
    name = _name_of(attribute)
    return "" if not name or is_known(name) else name


def _name_of(attribute: Usd.Attribute) -> str:
    return str(Usd.ColorSpaceAPI.ComputeColorSpaceName(attribute, None))
