"""The names that MaterialX and USD give to colour spaces. What is not sRGB or linear Rec. 709 is taken for linear."""

from __future__ import annotations

import numpy as np
from pxr import Usd

from defshade_cli.scene.texture import ColorSpace
from defshade_cli.usd.materialx.signal import Values

_LINEAR = ("", "none", "raw", "data", "identity", "unknown", "lin_rec709", "lin_rec709_scene", "linear")
_SRGB = ("srgb_texture", "srgb_rec709_scene", "sRGB", "srgb", "g22_rec709", "g22_rec709_scene")
"""A gamma of 2.2 is taken for sRGB, from which it is nowhere more than 0.01 away in linear light."""


def color_space(attribute: Usd.Attribute, lost: list[str]) -> ColorSpace:
    """Of an image, or of a constant, by the attribute that names it."""
    name = attribute.GetColorSpace() if attribute.HasColorSpace() else ""
    if name in _SRGB:
        return "sRGB"
    if name not in _LINEAR:
        lost.append(f"colour space {name}")
    return "raw"


def linearised(attribute: Usd.Attribute, values: Values, lost: list[str]) -> Values:
    """A constant's first three channels in linear light: IEC 61966-2-1."""
    if len(values) < 3 or color_space(attribute, lost) != "sRGB":
        return values
    color = values[:3]
    curved = ((np.maximum(color, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.concatenate([np.where(color <= 0.04045, color / 12.92, curved), values[3:]])
