"""The room that a surface takes by USD's own account, which is what usdrecord frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.surfaces.geometry import Surface
from defshade_cli.usd.values import floats


def stage_extent(stage: Usd.Stage, purposes: Sequence[str]) -> NDArray[np.float64]:
    """(2, 3) the box around all of a stage at the default time, in world space, as UsdGeomBBoxCache has it."""
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), list(purposes), useExtentsHint=True)
    box = cache.ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange()
    return np.array([box.GetMin(), box.GetMax()], np.float64)


def extents_of(stage: Usd.Stage, surfaces: Sequence[Surface], time: Usd.TimeCode) -> NDArray[np.float64]:
    """(N, 2, 3) least and greatest corners in object space: of the drawn polygons, or by USD's account.

    A cage is smaller than its solid, and what has no faces has no corners at all: for these USD is asked, which takes
    the authored extent, else computes one.
    """
    extents = bounds_of([surface.polygons for surface in surfaces])
    for number, surface in enumerate(surfaces):
        told = None if _is_drawn_whole(surface) else _told(stage.GetPrimAtPath(surface.path), surface, time)
        if told is not None:
            extents[number] = told
    return extents


def bounds_of(polygons: Sequence[Polygons]) -> NDArray[np.float64]:
    """(N, 2, 3) as Polygons.bounds, of all at once."""
    bounds = np.empty((len(polygons), 2, 3))
    bounds[:, 0], bounds[:, 1] = np.inf, -np.inf
    used = [(number, each) for number, each in enumerate(polygons) if len(each.indices)]
    if used:
        sizes = [len(each.indices) for _, each in used]
        starts = np.cumsum([0, *(len(each.points) for _, each in used)])[:-1]
        indices = np.concatenate([each.indices for _, each in used]) + np.repeat(starts, sizes)
        corners = np.concatenate([each.points for _, each in used])[indices]
        firsts = np.cumsum([0, *sizes])[:-1]
        rows = [number for number, _ in used]
        bounds[rows, 0] = np.minimum.reduceat(corners, firsts)
        bounds[rows, 1] = np.maximum.reduceat(corners, firsts)
    return bounds


def _is_drawn_whole(surface: Surface) -> bool:
    return surface.copies is not None or bool(surface.groups and surface.control is None)


def _told(prim: Usd.Prim, surface: Surface, time: Usd.TimeCode) -> NDArray[np.float64] | None:
    """(2, 3); None where the polygons' own count."""
    is_solid = surface.control is not None and not prim.IsA(UsdGeom.Mesh)
    if not prim.IsA(UsdGeom.Gprim) or (surface.groups and not is_solid):
        return None
    gprim = UsdGeom.Boundable(prim)
    authored = gprim.GetExtentAttr().Get(time) if gprim.GetExtentAttr().HasAuthoredValue() else None
    value = authored or UsdGeom.Boundable.ComputeExtentFromPlugins(gprim, time)
    box = None if value is None else floats(value, 3)
    if box is None or box.shape != (2, 3) or not np.isfinite(box).all() or (box[0] > box[1]).any():
        return None
    return box.astype(np.float64)
