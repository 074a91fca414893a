"""MaterialX's names of colour spaces, beside those that USD shares with it. Unknown ones count as linear."""

from __future__ import annotations

import numpy as np
from pxr import Usd

from defshade_cli.scene.texture import ColorSpace
from defshade_cli.usd.color_space import is_known, rec709_of, space_named, texture_space_of
from defshade_cli.usd.materials.materialx.signal import Values

_DATA = ("", "none", "linear")
_OF_MATERIALX = {
    "lin_rec709": "lin_rec709_scene",
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
"""MaterialX 1.38's and 1.39's standard spaces by their Color Interop IDs."""


def color_space(attribute: Usd.Attribute, lost: list[str]) -> ColorSpace:
    """Of an image, by the attribute that names it."""
    return texture_space_of(_name_of(attribute, lost))


def linearised(attribute: Usd.Attribute, values: Values, lost: list[str]) -> Values:
    """A constant whose first three channels are a colour, those in linear Rec. 709."""
    space = space_named(_name_of(attribute, lost)) if len(values) >= 3 else None
    return values if space is None else np.concatenate([rec709_of(space, values[:3]), values[3:]])


def _name_of(attribute: Usd.Attribute, lost: list[str]) -> str:
    """USD's name of the space; `raw` for none, and for one that nobody knows, which is lost."""
    own = attribute.GetColorSpace() if attribute.HasColorSpace() else ""
    name = _OF_MATERIALX.get(own, own)
    if name in _DATA:
        return "raw"
    if not is_known(name):
        lost.append(f"colour space {own}")
        return "raw"
    return name
