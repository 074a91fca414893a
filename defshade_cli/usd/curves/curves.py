"""BasisCurves → Strands. What contradicts itself is dropped, and said."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.usd.curves.basis import Kind
from defshade_cli.usd.curves.strands import Strands
from defshade_cli.usd.gprims.points import find_widths
from defshade_cli.usd.polygons.polygons import Primvar
from defshade_cli.usd.polygons.positions import read_positions
from defshade_cli.usd.polygons.primvars import DISPLAY_COLOR, Authored, Elements, authored, fit, read_carried
from defshade_cli.usd.values import integers

CURVES_ATTRIBUTES = ("points", "curveVertexCounts", "widths", "normals")
"""What is read of BasisCurves that may vary over time, besides primvars."""


def read_curves(
    curves: UsdGeom.BasisCurves, time: Usd.TimeCode, issues: list[str], color: str = DISPLAY_COLOR
) -> Strands:
    """All curves of the prim that can be drawn. Bad data becomes issues."""
    prim = curves.GetPrim()
    points = read_positions(prim, time)
    counts = integers(curves.GetCurveVertexCountsAttr().Get(time) or [])
    points = np.empty((0, 3), np.float32) if points is None else points
    counts = _complete(np.empty(0, np.int32) if counts is None else counts, len(points), issues)
    if not np.isfinite(points).all():
        issues.append("it is left out: not all of its points are finite")
        counts = counts[:0]
    as_authored = _kind(curves)
    kind = _closable(as_authored, counts, issues)
    if left_out := np.count_nonzero(kind.segments(counts) == 0):
        issues.append(f"{left_out} curves are left out: they have too few points, or cannot be closed")
    elements = kind.elements(counts, len(points))
    widths = read_widths(prim, time, elements, issues)
    normals = fit(read_normals(curves, time), 3, elements, issues)
    carried = read_carried(prim, time, elements, issues, color)
    return Strands(kind, counts, points, widths, normals, carried, loops=as_authored.closed)


def _complete(counts: NDArray[np.integer], available: int, issues: list[str]) -> NDArray[np.int64]:
    """The curves whose points are all there."""
    wanted = np.maximum(counts, 0).astype(np.int64)
    complete = int(np.searchsorted(np.cumsum(wanted), available, "right"))
    if not len(counts):
        issues.append("it has no curves")
    elif complete < len(counts):
        issues.append(f"{len(counts) - complete} curves are left out: points ends before them")
    return wanted[:complete]


def _kind(curves: UsdGeom.BasisCurves) -> Kind:
    basis = "linear" if curves.GetTypeAttr().Get() == UsdGeom.Tokens.linear else curves.GetBasisAttr().Get()
    return Kind(str(basis), str(curves.GetWrapAttr().Get()))


def _closable(kind: Kind, counts: NDArray[np.int64], issues: list[str]) -> Kind:
    """Periodic curves that no number of segments closes are open ones, as in Hydra."""
    as_open = Kind(kind.basis, "nonperiodic")
    if not kind.closed or kind.segments(counts).any() or not as_open.segments(counts).any():
        return kind
    issues.append("its curves are drawn open: they have too few points to be closed, or some too many")
    return as_open


def read_widths(prim: Usd.Prim, time: Usd.TimeCode, elements: Elements, issues: list[str]) -> Primvar | None:
    """primvars:widths, else widths; None, and said, where the curves become lines."""
    widths = find_widths(prim, time, elements, issues)
    if widths is None:
        issues.append("no widths that fit: its curves are drawn as lines one pixel wide")
    return widths


def read_normals(curves: UsdGeom.Curves, time: Usd.TimeCode) -> Authored | None:
    """primvars:normals, else normals."""
    primvar = authored(UsdGeom.PrimvarsAPI(curves).GetPrimvar("normals"), time)
    return primvar or Authored("normals", curves.GetNormalsAttr().Get(time), curves.GetNormalsInterpolation())
