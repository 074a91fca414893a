"""UsdGeom.NurbsCurves → Strands: lines between points on rational B-splines of any order.

The basis functions are those of Piegl and Tiller, "The NURBS Book", algorithm A2.2, of all samples at once. Knots of a
curve are as many as its points and its order, one curve's after the other's, as in NurbsPatch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.usd.curves.basis import Kind, Weights, sparse_weights
from defshade_cli.usd.curves.curves import CURVES_ATTRIBUTES, read_normals, read_widths
from defshade_cli.usd.curves.strands import Strands
from defshade_cli.usd.curves.tubes import TOUCHING
from defshade_cli.usd.nurbs.nurbs import homogeneous_points
from defshade_cli.usd.polygons.polygons import Primvar
from defshade_cli.usd.polygons.primvars import DISPLAY_COLOR, NOTHING_CARRIED, fit, read_carried
from defshade_cli.usd.values import integers, places_in_runs

NURBS_CURVES_ATTRIBUTES = (*CURVES_ATTRIBUTES, "order", "knots", "ranges", "pointWeights")
"""What is read of NurbsCurves that may vary over time, besides primvars."""

_STEPS_A_DEGREE = 6
"""Lines along a span between two knots, for each degree; one where the curve is linear."""

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class _Splines(NamedTuple):
    """C curves. counts, degrees: (C,).  knots: (K,) of all.  ranges: (C, 2).  control: (P, 4) homogeneous, of all."""

    counts: Integers
    degrees: Integers
    knots: Array
    ranges: Array
    control: Array


class _Lines(NamedTuple):
    """Lines between S points. wrap: of all curves.  curve: (S,) that each is of.  weights: (S, P) of control points."""

    wrap: str
    curve: Integers
    weights: Weights


class _Samples(NamedTuple):
    """S places along splines. curve: (S,), ascending.  span: (S,) knots of all before each.  at: (S,) parameters."""

    curve: Integers
    span: Integers
    at: Array


def read_nurbs_curves(
    curves: UsdGeom.NurbsCurves, time: Usd.TimeCode, issues: list[str], color: str = DISPLAY_COLOR
) -> Strands:
    """All curves of the prim, or none where what is authored does not make them. Bad data becomes issues."""
    prim = curves.GetPrim()
    try:
        splines = _splines(curves, time)
    except ValueError as error:
        issues.append(f"it is left out: {error}")
        none = np.empty(0, np.int64), np.empty((0, 3), np.float32)
        return Strands(Kind("linear", "nonperiodic"), *none, None, None, NOTHING_CARRIED, loops=False)
    wrap, curve, weights = _lines(splines)
    count = len(splines.control)
    elements = {"constant": 1, "uniform": len(splines.counts), "vertex": count, "varying": count}
    widths = read_widths(prim, time, elements, issues)
    normals = fit(read_normals(curves, time), 3, elements, issues)
    carried = read_carried(prim, time, elements, issues, color)
    return Strands(
        Kind("linear", wrap),
        np.bincount(curve, minlength=len(splines.counts)),
        _projected(weights @ splines.control).astype(np.float32),
        widths and _sampled(widths, weights),
        normals and _sampled(normals, weights),
        carried.mapped(lambda primvar: _sampled(primvar, weights)),
        loops=wrap == "periodic",
    )


def _splines(curves: UsdGeom.NurbsCurves, time: Usd.TimeCode) -> _Splines:
    """Raises ValueError with the reason where attributes do not fit each other."""
    counts, orders = _integers(curves.GetCurveVertexCountsAttr(), time), _integers(curves.GetOrderAttr(), time)
    if not len(counts) or len(orders) != len(counts) or (orders < 2).any() or (counts < orders).any():
        raise ValueError("its curves have no points, no order, or fewer points than their order")
    knots = np.asarray(curves.GetKnotsAttr().Get(time) or [], np.float64)
    sizes = counts + orders
    first = np.cumsum(sizes) - sizes
    steps = np.delete(np.diff(knots), first[1:] - 1) if len(knots) == sizes.sum() else np.full(1, np.nan)
    if not (steps >= 0.0).all() or not np.isfinite(knots).all():
        raise ValueError(f"knots are not {sizes.sum()} numbers that ascend along each curve")
    whole = np.column_stack([knots[first + orders - 1], knots[first + counts]])
    authored = np.asarray(curves.GetRangesAttr().Get(time) or whole, np.float64).reshape(-1, 2)
    if authored.shape != whole.shape:
        raise ValueError(f"ranges are not {len(counts)}")
    ranges = np.clip(authored, whole[:, :1], whole[:, 1:])
    if not (ranges[:, 0] < ranges[:, 1]).all():
        raise ValueError("the range of a curve is empty")
    return _Splines(counts, orders - 1, knots, ranges, homogeneous_points(curves, int(counts.sum()), time))


def _integers(attribute: Usd.Attribute, time: Usd.TimeCode) -> Integers:
    values = integers(attribute.Get(time) or [])
    return np.empty(0, np.int64) if values is None else values.astype(np.int64)


def _lines(splines: _Splines) -> _Lines:
    """All of them; closed ones where every curve ends where it begins."""
    samples = _samples(splines)
    weights = _weights(splines, samples)
    points = _projected(weights @ splines.control)
    turns = np.diff(samples.curve) != 0
    first, last = np.append(True, turns), np.append(turns, True)
    if (np.abs(points[first] - points[last]) > TOUCHING * np.ptp(points)).any():
        return _Lines("nonperiodic", samples.curve, weights)
    return _Lines("periodic", samples.curve[~last], weights[~last])


def _projected(homogeneous: Array) -> Array:
    """(N, 3) of (N, 4)."""
    return homogeneous[:, :3] / homogeneous[:, 3:]


def _samples(splines: _Splines) -> _Samples:
    """The beginning of every line, and the end of each curve's last."""
    counts, degrees = splines.counts, splines.degrees
    curve, place = places_in_runs(counts - degrees)
    sizes = counts + degrees + 1
    span = (np.cumsum(sizes) - sizes + degrees)[curve] + place
    low = np.maximum(splines.knots[span], splines.ranges[curve, 0])
    high = np.minimum(splines.knots[span + 1], splines.ranges[curve, 1])
    drawn = low < high
    curve, span, low, high = curve[drawn], span[drawn], low[drawn], high[drawn]
    steps = np.where(degrees[curve] == 1, 1, _STEPS_A_DEGREE * degrees[curve])
    row, step = places_in_runs(steps + (np.diff(curve, append=-1) != 0))
    return _Samples(curve[row], span[row], low[row] + (high - low)[row] * (step / steps[row]))


def _weights(splines: _Splines, samples: _Samples) -> Weights:
    """(S, P) of all control points at all samples."""
    rows, columns, weights = [], [], []
    sizes = splines.counts + splines.degrees + 1
    knots_before = (np.cumsum(sizes) - sizes)[samples.curve]
    points_before = (np.cumsum(splines.counts) - splines.counts)[samples.curve]
    for degree in np.unique(splines.degrees).tolist():
        row = np.flatnonzero(splines.degrees[samples.curve] == degree)
        first = points_before[row] + samples.span[row] - knots_before[row] - degree
        rows.append(np.repeat(row, degree + 1))
        columns.append((first[:, None] + np.arange(degree + 1)).ravel())
        weights.append(_basis(splines.knots, samples.span[row], samples.at[row], degree).ravel())
    shape = len(samples.curve), len(splines.control)
    return sparse_weights(np.concatenate(weights), np.concatenate(rows), np.concatenate(columns), shape)


def _basis(knots: Array, span: Integers, at: Array, degree: int) -> Array:
    """(S, degree + 1) the functions that are not zero between a knot and the next, by Cox and de Boor."""
    functions = np.ones((len(at), 1))
    for order in range(1, degree + 1):
        beside = span[:, None] + np.arange(1, order + 1)
        right, left = knots[beside], knots[beside - order]
        part = functions / (right - left)
        functions = np.zeros((len(at), order + 1))
        functions[:, :-1] = (right - at[:, None]) * part
        functions[:, 1:] += (at[:, None] - left) * part
    return functions


def _sampled(primvar: Primvar, weights: Weights) -> Primvar:
    """What lies on control points at the samples; it weighs as polynomials do."""
    if primvar.interpolation in ("constant", "uniform"):
        return primvar
    return Primvar((weights @ primvar.values.astype(np.float64)).astype(np.float32), "vertex")
