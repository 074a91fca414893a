"""Where the points of a prim are at a time, moved by velocities where there are any."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, Vt

from defshade_cli.usd.values import floats


def read_positions(prim: Usd.Prim, time: Usd.TimeCode, base: Usd.TimeCode | None = None) -> NDArray[np.float32] | None:
    """(P, 3) of a PointBased prim; None where no vectors of floats are authored, the only type that the schema has.

    Where velocities stand beside the points' last sample, points move on from there by them and by accelerations, as
    UsdGeomPointBased says, and are not interpolated: between samples, the number of points may change.
    base: the time whose last sample counts, where that is another than `time`.
    """
    if not is_carried_by_velocities(prim, time):
        return still_positions(prim, time)
    moved = UsdGeom.PointBased(prim).ComputePointsAtTime(time, base or time)
    return floats(moved, 3) if len(moved) else still_positions(prim, time)


def still_positions(prim: Usd.Prim, time: Usd.TimeCode) -> NDArray[np.float32] | None:
    """(P, 3), the same of a prim that no velocities carry."""
    value = prim.GetAttribute("points").Get(time)
    return np.asarray(value) if isinstance(value, Vt.Vec3fArray) else None


def is_carried_by_velocities(prim: Usd.Prim, time: Usd.TimeCode) -> bool:
    """Velocities carry points away from time samples; a default value is at all times where it is."""
    based = UsdGeom.PointBased(prim)
    if time.IsDefault() or not based.GetVelocitiesAttr().HasAuthoredValue():
        return False
    return based.GetPointsAttr().GetResolveInfo().GetSource() in (
        Usd.ResolveInfoSourceTimeSamples,
        Usd.ResolveInfoSourceValueClips,
    )
