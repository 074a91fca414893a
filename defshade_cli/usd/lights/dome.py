"""UsdLuxDomeLight and DomeLight_1: the sky's image, and how it stands."""

from __future__ import annotations

from typing import get_args

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux

from defshade_cli.scene.environment import SkyLayout
from defshade_cli.scene.texture import ImageFile
from defshade_cli.spaces import Matrix
from defshade_cli.usd.materials.texture import Unreadable, image_file

_Z_UP = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], np.float64)
"""The pole goes to +Z and latitude 0, longitude 0 to −Y, as DomeLight_1's schema says of a Z pole."""


def is_dome(prim: Usd.Prim) -> bool:
    """Whether the prim is a dome light, of either version of the schema."""
    return prim.IsA(UsdLux.DomeLight) or prim.IsA(UsdLux.DomeLight_1)


def sky_texture(prim: Usd.Prim, time: Usd.TimeCode) -> tuple[ImageFile | None, SkyLayout, str | None]:
    """The file of the sky's image at `time` and its layout; or none, and why where one is authored."""
    asset = prim.GetAttribute("inputs:texture:file").Get(time) or Sdf.AssetPath()
    layout = prim.GetAttribute("inputs:texture:format").Get(time)
    if not asset.path:
        return None, "automatic", None
    if not asset.resolvedPath:
        return None, "automatic", f"the texture {asset.path} is not found"
    try:
        file = image_file(asset.resolvedPath)
    except Unreadable as problem:
        return None, "automatic", f"the texture {asset.path} is ignored: {problem}"
    if layout not in get_args(SkyLayout):
        return file, "automatic", f"there is no texture format {layout}: automatic is taken"
    return file, layout, None


def pole(prim: Usd.Prim) -> Matrix:
    """(4, 4) light_from_sky: DomeLight's pole is +Y, DomeLight_1's as its poleAxis says."""
    if prim.IsA(UsdLux.DomeLight):
        return np.eye(4)
    axis = UsdLux.DomeLight_1(prim).GetPoleAxisAttr().Get()
    is_z = axis == "Z" or (axis == "scene" and UsdGeom.GetStageUpAxis(prim.GetStage()) == UsdGeom.Tokens.z)
    return _Z_UP if is_z else np.eye(4)
