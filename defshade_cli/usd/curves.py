"""BasisCurves → Polygons: tubes, or ribbons where normals are authored.

Every sample of every curve is a weighted sum of control points: one sparse matrix takes points, and whatever lies on
them, to samples.

    segments of control points ── basis ── samples along the curves ── frames ── tubes | ribbons
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.usd.basis import LARGEST_DETAIL, CurveSamples, Kind, sample_curves
from defshade_cli.usd.points import find_widths
from defshade_cli.usd.polygons import Polygons, Primvar
from defshade_cli.usd.positions import read_positions
from defshade_cli.usd.primvars import DISPLAY_COLOR, Authored, authored, fit, read_carried
from defshade_cli.usd.strands import Strands, laid_along
from defshade_cli.usd.tubes import ribbons, tubes
from defshade_cli.usd.values import integers

CURVES_ATTRIBUTES = ("points", "curveVertexCounts", "widths", "normals")
"""What is read of BasisCurves that may vary over time, besides primvars."""

QUAD_BUDGET = 1_000_000
"""Quads of one prim up to which its tubes are round, and its segments many; more get the next lower detail."""

_DETAILS = ((LARGEST_DETAIL, 12), (4, 6), (2, 3))
"""Samples a segment of cubic curves, and sides of tubes."""


def read_curves(
    curves: UsdGeom.BasisCurves, time: Usd.TimeCode, issues: list[str], color: str = DISPLAY_COLOR
) -> tuple[Polygons, Strands]:
    """All curves of the prim, each a face in the sense of `Polygons.faces`, and before they are sampled.

    Bad data becomes issues.
    """
    points = read_positions(curves.GetPrim(), time)
    counts = integers(curves.GetCurveVertexCountsAttr().Get(time) or [])
    points = np.empty((0, 3), np.float32) if points is None else points
    counts = _complete(np.empty(0, np.int32) if counts is None else counts, len(points), issues)
    if not np.isfinite(points).all():
        issues.append("it is left out: not all of its points are finite")
        counts = counts[:0]
    as_authored = _kind(curves)
    kind = _closable(as_authored, counts, issues)
    samples, sides = _detailed(kind, counts, len(points))
    if samples.left_out:
        issues.append(f"{samples.left_out} curves are left out: they have too few points, or cannot be closed")
    prim = curves.GetPrim()
    widths = find_widths(prim, time, samples.elements, issues)
    if widths is None:
        issues.append("no widths that fit: its curves are drawn as lines one pixel wide")
    normals = fit(_normals(curves, time), 3, samples.elements, issues)
    carried = read_carried(prim, time, samples.elements, issues, color)
    strands = Strands(kind, counts, points, widths, carried, normals is not None, as_authored.closed)
    return _swept(strands, samples, normals, sides), strands


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


def _detailed(kind: Kind, counts: NDArray[np.int64], points: int) -> tuple[CurveSamples, int]:
    """The finest samples within the budget, and sides."""
    for detail, sides in _DETAILS:
        samples = sample_curves(kind, counts, points, detail)
        if samples.count * sides <= QUAD_BUDGET:
            break
    return samples, sides


def _swept(strands: Strands, samples: CurveSamples, normals: Primvar | None, sides: int) -> Polygons:
    centres = samples.vertex @ strands.points.astype(np.float64)
    radii = np.zeros(samples.count) if strands.widths is None else samples.at(strands.widths) / 2.0
    if normals is None:
        shape = tubes(samples, centres, radii, sides)
    else:
        shape = ribbons(samples, centres, radii, samples.at(normals))
    around = len(shape.points) // max(samples.count, 1)
    return laid_along(shape, strands.carried, samples, np.repeat(np.arange(samples.count), around))


def _normals(curves: UsdGeom.BasisCurves, time: Usd.TimeCode) -> Authored | None:
    primvar = authored(UsdGeom.PrimvarsAPI(curves).GetPrimvar("normals"), time)
    return primvar or Authored("normals", curves.GetNormalsAttr().Get(time), curves.GetNormalsInterpolation())
