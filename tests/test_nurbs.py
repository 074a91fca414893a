"""NurbsPatch: on the surface, facing outwards, with its colours; and what is wrong with one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import UsdGeom, Vt

from defshade_cli.usd.surfaces.varying import is_time_varying
from prims import new_stage, read, reasons, set_primvar

HALF = math.sqrt(0.5)
CIRCLE = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], float)
WEIGHTS = np.array([1, HALF] * 4 + [1])
CIRCLE_KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]


def patch(points: NDArray, u: tuple[int, int, list], v: tuple[int, int, list], weights: NDArray | None = None):
    schema = UsdGeom.NurbsPatch.Define(new_stage(), "/patch")
    schema.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points.reshape(-1, 3), np.float32)))
    for name, (count, order, knots) in {"U": u, "V": v}.items():
        getattr(schema, f"Create{name}VertexCountAttr")(count)
        getattr(schema, f"Create{name}OrderAttr")(order)
        getattr(schema, f"Create{name}KnotsAttr")(knots)
    if weights is not None:
        schema.CreatePointWeightsAttr(weights.ravel().tolist())
    return schema


def tube() -> UsdGeom.NurbsPatch:
    """A cylinder of radius 1 and height 2: a circle along u, exact as a rational one, a line along v."""
    points = np.stack([np.column_stack([CIRCLE, np.full(9, z)]) for z in (0.0, 2.0)])
    return patch(points, (9, 3, CIRCLE_KNOTS), (2, 2, [0, 0, 1, 1]), np.tile(WEIGHTS, 2))


def test_a_rational_patch_lies_on_its_cylinder() -> None:
    drawn = read(tube())
    radial = drawn.mesh.points * (1, 1, 0)
    np.testing.assert_allclose(np.linalg.norm(radial, axis=1), 1, rtol=1e-6)
    np.testing.assert_allclose(drawn.mesh.normals, radial, atol=1e-5)
    np.testing.assert_allclose(drawn.mesh.bounds, [[-1, -1, 0], [1, 1, 2]], atol=1e-6)
    a, b, c = drawn.mesh.points[drawn.mesh.triangles].swapaxes(0, 1)
    assert (np.einsum("ti,ti->t", np.cross(b - a, c - a), a * (1, 1, 0)) > 0).all() and not drawn.issues


def test_left_handed_patches_face_the_other_way() -> None:
    schema = tube()
    schema.CreateOrientationAttr("leftHanded")
    drawn = read(schema)
    a, b, c = drawn.mesh.points[drawn.mesh.triangles].swapaxes(0, 1)
    assert (np.einsum("ti,ti->t", np.cross(b - a, c - a), drawn.mesh.normals[drawn.mesh.triangles[:, 0]]) > 0).all()
    np.testing.assert_allclose(drawn.mesh.normals, -drawn.mesh.points * (1, 1, 0), atol=1e-5)


def test_a_range_cuts_the_patch() -> None:
    schema = tube()
    schema.CreateURangeAttr((0.0, 1.0))
    np.testing.assert_allclose(read(schema).mesh.bounds, [[0, 0, 0], [1, 1, 2]], atol=1e-6)


def test_vertex_primvars_follow_the_control_points() -> None:
    grid = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0)), axis=-1)
    points = np.concatenate([grid, np.zeros((4, 4, 1))], axis=-1)
    schema = patch(points, (4, 4, [0] * 4 + [1] * 4), (4, 4, [0] * 4 + [1] * 4))
    set_primvar(schema, "st", [tuple(map(float, p)) for p in grid.reshape(-1, 2)], "vertex", "texCoord2f[]")
    mesh = read(schema).mesh
    np.testing.assert_allclose(mesh.uvs["st"], mesh.points[:, :2], atol=1e-6)
    assert len(mesh.points) == 33**2 and (mesh.normals == (0, 0, 1)).all()


def test_varying_primvars_are_bilinear_in_each_span() -> None:
    """A flat patch whose points are its parameters, of two spans along u and one along v."""
    u, v = np.array([0.0, 0.25, 0.75, 1.0]), np.array([0.0, 0.5, 1.0])  # Greville abscissae
    points = np.stack(np.broadcast_arrays(u, v[:, None], 0.0), axis=-1)
    schema = patch(points, (4, 3, [0, 0, 0, 0.5, 1, 1, 1]), (3, 3, [0] * 3 + [1] * 3))
    set_primvar(schema, "st", [(0, 0), (2, 0), (1, 0), (0, 1), (2, 1), (1, 1)], "varying", "texCoord2f[]")
    drawn = read(schema)
    across, along, _ = drawn.mesh.points.T
    due = np.stack([np.interp(across, [0, 0.5, 1], [0, 2, 1]), along], axis=-1)
    np.testing.assert_allclose(drawn.mesh.uvs["st"], due, atol=1e-6)
    assert not drawn.issues


def test_patches_of_many_spans_are_sampled_more_coarsely() -> None:
    count = 41
    grid = np.stack(np.broadcast_arrays(np.arange(count), np.arange(count)[:, None], 0.0), axis=-1)
    knots = (count, 2, [0, *range(count), count - 1])
    trimmed = (count, 3, [0, 0, *range(count - 1), count - 2, count - 2])
    assert len(read(patch(grid, knots, knots)).mesh.points) == count**2
    assert len(read(patch(grid, trimmed, trimmed)).mesh.points) == (8 * (count - 2) + 1) ** 2


def test_a_pole_has_a_normal() -> None:
    points = np.stack([np.column_stack([CIRCLE * r, np.full(9, z)]) for r, z in ((1.0, 0.0), (0.0, 1.0))])
    drawn = read(patch(points, (9, 3, CIRCLE_KNOTS), (2, 2, [0, 0, 1, 1]), np.tile(WEIGHTS, 2)))
    np.testing.assert_allclose(np.linalg.norm(drawn.mesh.normals, axis=1), 1, rtol=1e-5)
    assert (drawn.mesh.normals[:, 2] > 0.1).all()


@pytest.mark.parametrize(
    ("attribute", "value", "reason"),
    [
        ("uOrder", 1, "uOrder 1 and 9 points along u make no surface"),
        ("vKnots", [0, 1], "vKnots are not 4 ascending numbers"),
        ("vKnots", [0, 0, -1, 1], "vKnots are not 4 ascending numbers"),
        ("uRange", (3.0, 3.0), "uRange is empty"),
        ("pointWeights", [1.0], "pointWeights are not 18 positive numbers"),
        ("uVertexCount", 8, "uKnots are not 11 ascending numbers"),
    ],
)
def test_bad_patches_are_left_out_and_said(attribute: str, value: object, reason: str) -> None:
    schema = tube()
    schema.GetPrim().GetAttribute(attribute).Set(value)
    drawn = read(schema)
    assert reasons(drawn) == [f"it is left out: {reason}"] and not drawn.surface.groups


def sheet(spans: int = 1) -> UsdGeom.NurbsPatch:
    """The square from 0 to 4 in the plane z = 0, along which u and v are x and y."""
    at = np.linspace(0.0, 4.0, spans + 1)
    grid = np.stack(np.meshgrid(at, at), axis=-1)
    along = (spans + 1, 2, [0.0, *at.tolist(), 4.0])
    return patch(np.concatenate([grid, np.zeros((*grid.shape[:2], 1))], axis=-1), along, along)


def circle(radius: float, center: tuple[float, float] = (2.0, 2.0), *, clockwise: bool = False) -> NDArray:
    """(9, 3) homogeneous points of a rational circle."""
    points = np.column_stack([(CIRCLE * radius + center) * WEIGHTS[:, None], WEIGHTS])
    return points[::-1] if clockwise else points


def trimmed(schema: UsdGeom.NurbsPatch, *circles: NDArray) -> UsdGeom.NurbsPatch:
    """With a loop a circle."""
    count = len(circles)
    schema.CreateTrimCurveCountsAttr([1] * count)
    schema.CreateTrimCurveOrdersAttr([3] * count)
    schema.CreateTrimCurveVertexCountsAttr([9] * count)
    schema.CreateTrimCurveKnotsAttr(CIRCLE_KNOTS * count)
    schema.CreateTrimCurveRangesAttr([(0.0, 4.0)] * count)
    schema.CreateTrimCurvePointsAttr([tuple(map(float, point)) for loop in circles for point in loop])
    return schema


def area(schema: UsdGeom.NurbsPatch) -> float:
    drawn = read(schema)
    assert not drawn.issues
    a, b, c = drawn.mesh.points[drawn.mesh.triangles].astype(float).swapaxes(0, 1)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


@pytest.mark.parametrize(
    ("circles", "expected"),
    [
        ([circle(1.0)], math.pi),
        ([circle(1.5), circle(0.5, clockwise=True)], math.pi * 2.0),
        ([circle(1.5), circle(0.5)], math.pi * 2.0),
        ([circle(1.5), circle(1.0, clockwise=True), circle(0.5)], math.pi * 1.5),
        ([circle(1.0, clockwise=True)], 16.0 - math.pi),
        ([circle(0.75, (1.0, 1.0)), circle(0.75, (3.0, 3.0))], math.pi * 1.125),
        ([circle(1.0, (4.0, 2.0))], math.pi / 2.0),
        ([circle(1.0, (4.0, 4.0), clockwise=True)], 16.0 - math.pi / 4.0),
        ([circle(9.0)], 16.0),
    ],
)
def test_trim_curves_bound_what_is_drawn(circles: list[NDArray], expected: float) -> None:
    for spans in (1, 5):
        assert area(trimmed(sheet(spans), *circles)) == pytest.approx(expected, rel=2e-3)


def test_cells_that_are_cut_and_whole_ones_share_their_points() -> None:
    """A side of one triangle alone is on a curve or on the border."""
    mesh = read(trimmed(sheet(6), circle(1.5), circle(0.5, clockwise=True), circle(1.0, (4.0, 4.0)))).mesh
    sides = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    found, times = np.unique(sides, axis=0, return_counts=True)
    x, y = mesh.points[found[times == 1]].mean(axis=1)[:, :2].T
    around = np.hypot(x - 2.0, y - 2.0)
    on_curve = np.min(np.abs([around - 1.5, around - 0.5, np.hypot(x - 4.0, y - 4.0) - 1.0]), axis=0) < 0.01
    assert times.max() == 2 and (on_curve | (x > 4.0 - 1e-6) | (y > 4.0 - 1e-6)).all()


def test_a_trim_of_several_curves_is_exact_where_they_are_lines() -> None:
    corners = [(0.5, 0.5), (3.5, 0.5), (2.0, 3.0)]
    schema = sheet()
    schema.CreateTrimCurveCountsAttr([3])
    schema.CreateTrimCurveOrdersAttr([2] * 3)
    schema.CreateTrimCurveVertexCountsAttr([2] * 3)
    schema.CreateTrimCurveKnotsAttr([0.0, 0.0, 1.0, 1.0] * 3)
    schema.CreateTrimCurveRangesAttr([(0.0, 1.0)] * 3)
    schema.CreateTrimCurvePointsAttr([(*corners[(i + k) % 3], 1.0) for i in range(3) for k in range(2)])
    assert area(schema) == pytest.approx(0.5 * 3.0 * 2.5, rel=1e-6)


def test_a_trimmed_tube_keeps_its_shape_and_coordinates() -> None:
    schema = tube()
    set_primvar(schema, "st", [(x, y) for y in (0.0, 1.0) for x in range(9)], "vertex", "texCoord2f[]")
    drawn = read(trimmed(schema, circle(0.4, (2.0, 0.5))))
    used = np.unique(drawn.mesh.triangles)
    points, normals = drawn.mesh.points[used], drawn.mesh.normals[used]
    np.testing.assert_allclose(np.linalg.norm(points[:, :2], axis=1), 1, rtol=1e-6)
    np.testing.assert_allclose(normals, points * (1, 1, 0), atol=1e-5)
    np.testing.assert_allclose(points[:, 2], 2 * drawn.mesh.uvs["st"][used, 1], atol=1e-6)
    assert (points[:, 0] < -0.7).all() and 0.2 - 1e-6 <= points[:, 2].min() <= points[:, 2].max() <= 1.8 + 1e-6


@pytest.mark.parametrize(
    ("attribute", "value", "reason"),
    [
        ("counts", [2], "they are not 2 curves"),
        ("orders", [10], "a curve has fewer points than its order"),
        ("knots", [0.0, 1.0], "they have not 9 points and 12 knots"),
        (
            "knots",
            CIRCLE_KNOTS[::-1],
            "a curve has descending knots, an empty range, or weights that are not positive",
        ),
    ],
)
def test_trim_curves_that_do_not_fit_are_said_to_be_ignored(attribute: str, value: object, reason: str) -> None:
    schema = trimmed(sheet(), circle(1.0))
    schema.GetPrim().GetAttribute(f"trimCurve:{attribute}").Set(value)
    drawn = read(schema)
    assert reasons(drawn) == [f"trim curves are ignored: {reason}"] and len(drawn.mesh.triangles) == 2


def test_missing_trim_attributes_are_said() -> None:
    schema = sheet()
    schema.CreateTrimCurveCountsAttr([1])
    assert reasons(read(schema)) == ["trim curves are ignored: trimCurve:orders is missing or of another type"]


def test_a_trim_that_leaves_nothing_is_said() -> None:
    drawn = read(trimmed(sheet(), circle(1.0, (9.0, 9.0))))
    assert reasons(drawn) == ["its trim curves leave nothing of it"] and not drawn.surface.groups


def test_moving_points_make_the_patch_vary() -> None:
    schema = tube()
    assert not is_time_varying(schema.GetPrim())
    points = schema.GetPointsAttr().Get()
    schema.GetPointsAttr().Set(points, 1.0)
    schema.GetPointsAttr().Set(Vt.Vec3fArray([p * 2 for p in points]), 2.0)
    assert is_time_varying(schema.GetPrim())
