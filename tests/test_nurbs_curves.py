"""NurbsCurves: on their curves, with what lies on their control points; and what is wrong with one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pxr import UsdGeom, Vt
from scipy.interpolate import BSpline

from defshade_cli.usd.curves.nurbs_curves import read_nurbs_curves
from defshade_cli.usd.curves.strands import Strands
from defshade_cli.usd.surfaces.varying import is_time_varying
from prims import DEFAULT, new_stage, read, reasons, set_primvar
from test_nurbs import CIRCLE, CIRCLE_KNOTS, WEIGHTS


def curves(points: NDArray, counts: list[int], orders: list[int], knots: list[float]) -> UsdGeom.NurbsCurves:
    schema = UsdGeom.NurbsCurves.Define(new_stage(), "/curves")
    schema.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(points, np.float32)))
    schema.CreateCurveVertexCountsAttr(counts)
    schema.CreateOrderAttr(orders)
    schema.CreateKnotsAttr(knots)
    schema.CreateWidthsAttr([0.2])
    return schema


def ring() -> UsdGeom.NurbsCurves:
    """A circle of radius 1, exact as a rational curve."""
    schema = curves(np.column_stack([CIRCLE, np.zeros(9)]), [9], [3], CIRCLE_KNOTS)
    schema.CreatePointWeightsAttr(WEIGHTS.tolist())
    return schema


def strands(schema: UsdGeom.NurbsCurves) -> Strands:
    issues: list[str] = []
    found = read_nurbs_curves(schema, DEFAULT, issues)
    assert not issues
    return found


def scipys(order: int, knots: NDArray, control: NDArray) -> NDArray:
    """As many points to a span as we take."""
    spans = np.unique(knots[order - 1 : 1 - order])
    steps = 1 if order == 2 else 6 * (order - 1)
    starts = spans[:-1, None] + np.diff(spans)[:, None] * np.arange(steps) / steps
    return BSpline(knots, control, order - 1)(np.append(starts, spans[-1]))


@given(st.lists(st.tuples(st.integers(2, 6), st.integers(0, 4), st.integers(0, 99)), min_size=1, max_size=4))
def test_curves_of_all_orders_are_scipys(shapes: list[tuple[int, int, int]]) -> None:
    knots, controls = [], []
    for order, more, seed in shapes:
        random = np.random.default_rng(seed)
        inner = np.sort(random.choice([0.25, 0.5, 0.5, 0.75], more)) if order > 2 else np.arange(1, more + 1) / 8
        knots.append(np.concatenate([np.sort(-random.random(order)), inner, np.sort(1.0 + random.random(order))]))
        controls.append(random.random((order + more, 3)))
    orders = [order for order, _, _ in shapes]
    schema = curves(np.concatenate(controls), [len(c) for c in controls], orders, np.concatenate(knots).tolist())
    expected = [scipys(*curve) for curve in zip(orders, knots, controls, strict=True)]
    found = strands(schema)
    assert found.counts.tolist() == [len(points) for points in expected]
    np.testing.assert_allclose(found.points, np.concatenate(expected), atol=1e-5)


def test_a_rational_ring_is_round() -> None:
    drawn = read(ring())
    across = np.hypot(np.linalg.norm(drawn.mesh.points[:, :2], axis=1) - 1.0, drawn.mesh.points[:, 2])
    assert not drawn.issues and (across <= 0.1 + 1e-3).all()
    np.testing.assert_allclose(np.linalg.norm(strands(ring()).points, axis=1), 1.0, rtol=1e-6)


def test_curves_that_end_where_they_begin_are_closed() -> None:
    found, open_one = strands(ring()), ring()
    open_one.CreateRangesAttr([(0.0, 3.0)])
    assert found.kind.closed and found.loops and not strands(open_one).kind.closed
    assert np.linalg.norm(np.diff(found.points, axis=0), axis=1).min() > 0.1


def test_a_closed_curve_beside_an_open_one_has_no_notch() -> None:
    """The tube around it ends where it begins, with the normals that it begins with."""
    alone, line = ring(), [(0, 0, 0), (0, 0, 1)]
    both = curves(
        np.append(np.array(alone.GetPointsAttr().Get()), line, axis=0),
        [9, 2],
        [3, 2],
        [*alone.GetKnotsAttr().Get(), 0, 0, 1, 1],
    )
    both.CreatePointWeightsAttr([*alone.GetPointWeightsAttr().Get(), 1, 1])
    polygons, found = read(both).surface.polygons, strands(both)
    around = len(polygons.points) // len(found.points)
    ends = np.array([0, found.counts[0] - 1])
    for values in (polygons.points, polygons.normals.values):
        first, last = values.reshape(-1, around, 3)[ends]
        np.testing.assert_allclose(last, first, atol=1e-6)


def test_a_range_cuts_the_curve() -> None:
    schema = ring()
    schema.CreateRangesAttr([(0.0, 1.0)])
    points = strands(schema).points
    np.testing.assert_allclose(points[[0, -1]], [(1, 0, 0), (0, 1, 0)], atol=1e-6)


def test_lines_need_no_points_between_theirs() -> None:
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0)], float)
    np.testing.assert_array_equal(strands(curves(corners, [3], [2], [0, 0, 1, 2, 2])).points, corners)


def test_what_lies_on_control_points_follows_them() -> None:
    control = np.linspace((0, 0, 0), (3, 0, 0), 4)
    schema = curves(control, [4], [4], [0] * 4 + [1] * 4)
    schema.CreateWidthsAttr([0.0, 1.0, 2.0, 3.0])
    set_primvar(schema, "st", [(x, 0.0) for x in (0.0, 1.0, 2.0, 3.0)], "vertex", "texCoord2f[]")
    found = strands(schema)
    assert found.widths is not None
    np.testing.assert_allclose(found.widths.values, found.points[:, 0], atol=1e-6)
    mesh = read(schema).mesh
    np.testing.assert_allclose(mesh.uvs["st"][:, 0], mesh.points[:, 0], atol=1e-5)


def test_colours_of_curves_stay_theirs() -> None:
    lines = curves(np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], float), [2, 2], [2, 2], [0, 0, 1, 1] * 2)
    set_primvar(lines, "displayColor", [(1, 0, 0), (0, 1, 0)], "uniform")
    color = read(lines).surface.polygons.display_color
    assert color is not None and color.interpolation == "vertex"
    low = read(lines).surface.polygons.points[:, 1] < 0.5
    np.testing.assert_array_equal(color.values, np.where(low[:, None], (1, 0, 0), (0, 1, 0)))


@pytest.mark.parametrize(
    ("attribute", "value", "reason"),
    [
        ("order", [1], "its curves have no points, no order, or fewer points than their order"),
        ("order", [10], "its curves have no points, no order, or fewer points than their order"),
        ("order", [3, 3], "its curves have no points, no order, or fewer points than their order"),
        ("knots", CIRCLE_KNOTS[::-1], "knots are not 12 numbers that ascend along each curve"),
        ("knots", [0.0], "knots are not 12 numbers that ascend along each curve"),
        ("ranges", [(0.0, 1.0), (0.0, 1.0)], "ranges are not 1"),
        ("ranges", [(2.0, 2.0)], "the range of a curve is empty"),
        ("pointWeights", [1.0], "pointWeights are not 9 positive numbers"),
        ("curveVertexCounts", [8], "knots are not 11 numbers that ascend along each curve"),
    ],
)
def test_bad_curves_are_left_out_and_said(attribute: str, value: object, reason: str) -> None:
    schema = ring()
    schema.GetPrim().GetAttribute(attribute).Set(value)
    drawn = read(schema)
    assert reasons(drawn) == [f"it is left out: {reason}"] and not drawn.surface.groups


def test_moving_knots_are_seen() -> None:
    schema = ring()
    assert not is_time_varying(schema.GetPrim())
    schema.GetKnotsAttr().Set(CIRCLE_KNOTS, 1.0)
    schema.GetKnotsAttr().Set(CIRCLE_KNOTS, 2.0)
    assert is_time_varying(schema.GetPrim())
