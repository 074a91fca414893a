"""UsdGeom.Points as spheres, or disks that are turned to the image: one that is placed at every point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.usd.gprims.copies import Copies
from defshade_cli.usd.gprims.gprims import Solid, sphere
from defshade_cli.usd.gprims.revolution import disk, revolve
from defshade_cli.usd.polygons.polygons import Polygons, Primvar
from defshade_cli.usd.polygons.positions import read_positions
from defshade_cli.usd.polygons.primvars import (
    DISPLAY_COLOR,
    Authored,
    Elements,
    authored,
    count_elements,
    fit,
    read_display,
)
from defshade_cli.usd.values import floats

POINTS_ATTRIBUTES = ("points", "widths", "ids")
"""What is read of Points that may vary over time, besides primvars."""

FALLBACK_WIDTH = 1.0
"""Where no width is authored, as in Hydra."""

_SEGMENTS = ((1_000, 32), (20_000, 16))
"""Up to how many points their spheres have how many segments around; more have the least."""
_FEWEST_SEGMENTS = 8


def read_points(
    points: UsdGeom.Points, time: Usd.TimeCode, issues: list[str], color: str = DISPLAY_COLOR, *, as_disks: bool
) -> tuple[Polygons, Copies, Solid | None]:
    """A sphere or a disk of diameter 1, and the points that it is placed at: all that are finite."""
    positions = read_positions(points.GetPrim(), time)
    if positions is None or not len(positions):
        issues.append("it has no points")
        positions = np.empty((0, 3), np.float32)
    if points.GetNormalsAttr().HasAuthoredValue():
        issues.append("normals of points are ignored: spheres are drawn")
    copies = _copies(points, positions, time, issues, color)
    segments = _segments(len(copies.ids))
    if as_disks:
        return revolve([disk(0.5, 0.0, 1)], 2 * segments), copies, None
    ball = Solid(sphere, "Z", (0.5,), segments)
    return ball.polygons(), copies, ball


def find_widths(prim: Usd.Prim, time: Usd.TimeCode, elements: Elements, issues: list[str]) -> Primvar | None:
    """primvars:widths, else widths. A single value serves all, whatever its interpolation; None where none fits."""
    primvar = authored(UsdGeom.PrimvarsAPI(prim).GetPrimvar("widths"), time)
    attribute = prim.GetAttribute("widths")
    interpolation = attribute.GetMetadata("interpolation") or UsdGeom.Tokens.vertex
    source = primvar or Authored("widths", attribute.Get(time), interpolation)
    value = None if source.value is None else floats(source.value, 1)
    if value is not None and len(value) == 1:
        return Primvar(np.abs(value), "constant")
    widths = fit(source, 1, elements, issues)
    return None if widths is None else replace(widths, values=np.abs(widths.values))


def _widths(prim: Usd.Prim, time: Usd.TimeCode, elements: Elements, issues: list[str]) -> Primvar:
    if (widths := find_widths(prim, time, elements, issues)) is not None:
        return widths
    issues.append(f"no widths that fit: {FALLBACK_WIDTH:g} is taken")
    return Primvar(np.full(1, FALLBACK_WIDTH, np.float32), "constant")


def _copies(
    points: UsdGeom.Points, positions: NDArray[np.float32], time: Usd.TimeCode, issues: list[str], primvar: str
) -> Copies:
    prim, count = points.GetPrim(), len(positions)
    elements = count_elements(1, count, count)
    color = read_display(prim, primvar, 3, time, elements, issues)
    opacity = read_display(prim, "displayOpacity", 1, time, elements, issues)
    widths = np.broadcast_to(_widths(prim, time, elements, issues).values, (count,))
    drawn = np.isfinite(positions).all(axis=1) & np.isfinite(widths)
    if not drawn.all():
        issues.append(f"{np.count_nonzero(~drawn)} points are left out: they are not finite")
    return Copies(
        _placed(positions, widths)[drawn],
        np.arange(count, dtype=np.int32)[drawn],
        np.broadcast_to(np.float32(np.nan) if color is None else color.values, (count, 3))[drawn],
        np.broadcast_to(np.float32(np.nan) if opacity is None else opacity.values, (count,))[drawn],
        count,
    )


def _placed(positions: NDArray[np.float32], widths: NDArray[np.float32]) -> NDArray[np.float64]:
    """(N, 4, 4)"""
    matrices = np.zeros((len(positions), 4, 4))
    matrices[:, [0, 1, 2], [0, 1, 2]] = widths[:, None]
    matrices[:, :3, 3] = positions
    matrices[:, 3, 3] = 1.0
    return matrices


def _segments(count: int) -> int:
    return next((segments for most, segments in _SEGMENTS if count <= most), _FEWEST_SEGMENTS)
