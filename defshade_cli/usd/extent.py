"""The room that a surface takes by USD's own account, which is what usdrecord frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.usd.geometry import Surface
from defshade_cli.usd.values import floats


def stage_extent(stage: Usd.Stage, purposes: Sequence[str]) -> NDArray[np.float64]:
    """(2, 3) the box around all of a stage at the default time, in world space, as UsdGeomBBoxCache has it."""
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), list(purposes), useExtentsHint=True)
    box = cache.ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange()
    return np.array([box.GetMin(), box.GetMax()], np.float64)


def extent_of(stage: Usd.Stage, surface: Surface, time: Usd.TimeCode) -> NDArray[np.float64]:
    """(2, 3) least and greatest corner in object space, where they are not the drawn polygons' own.

    A cage is smaller than its solid, and what has no faces has no corners at all: for these USD is asked, which takes
    the authored extent, else computes one.
    """
    if surface.copies is not None or (surface.groups and surface.control is None):
        return surface.polygons.bounds
    prim = stage.GetPrimAtPath(surface.path)
    is_solid = surface.control is not None and not prim.IsA(UsdGeom.Mesh)
    if not prim.IsA(UsdGeom.Gprim) or (surface.groups and not is_solid):
        return surface.polygons.bounds
    gprim = UsdGeom.Boundable(prim)
    authored = gprim.GetExtentAttr().Get(time) if gprim.GetExtentAttr().HasAuthoredValue() else None
    value = authored or UsdGeom.Boundable.ComputeExtentFromPlugins(gprim, time)
    box = None if value is None else floats(value, 3)
    if box is None or box.shape != (2, 3) or not np.isfinite(box).all() or (box[0] > box[1]).any():
        return surface.polygons.bounds
    return box.astype(np.float64)
