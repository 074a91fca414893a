"""BasisCurves: bases, wraps, tubes and ribbons, and what lies on them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from pxr import UsdGeom, Vt
from scipy.interpolate import BSpline

from defshade_cli.usd.curves.basis import Kind, sample_curves
from defshade_cli.usd.surfaces.varying import is_time_varying
from prims import Drawn, new_stage, read, reasons, set_primvar

LINE = [(0, 0, 0), (0, 0, 1), (0, 0, 2), (0, 0, 3)]
SQUARE = [(1, 1, 0), (-1, 1, 0), (-1, -1, 0), (1, -1, 0)]


def curves(
    points: ArrayLike, counts: list[int], basis: str = "bspline", wrap: str = "nonperiodic", width: float | None = 0.2
) -> UsdGeom.BasisCurves:
    schema = UsdGeom.BasisCurves.Define(new_stage(), "/curves")
    schema.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(points, np.float32).reshape(-1, 3)))
    schema.CreateCurveVertexCountsAttr(counts)
    schema.CreateTypeAttr("linear" if basis == "linear" else "cubic")
    schema.CreateWrapAttr(wrap)
    if basis != "linear":
        schema.CreateBasisAttr(basis)
    if width is not None:
        schema.CreateWidthsAttr([width])
        schema.SetWidthsInterpolation("constant")
    return schema


def centres(basis: str, wrap: str, points: ArrayLike, detail: int = 8) -> np.ndarray:
    samples = sample_curves(Kind(basis, wrap), np.array([len(points)]), len(points), detail)
    return samples.vertex @ np.asarray(points, float)


def distances(drawn: Drawn, along: int = 2) -> np.ndarray:
    """(V,) of the points from the axis `along`."""
    return np.linalg.norm(np.delete(drawn.mesh.points, along, axis=1), axis=1)


# Samples


@pytest.mark.parametrize("wrap", ["nonperiodic", "periodic", "pinned"])
@pytest.mark.parametrize("basis", ["linear", "bezier", "bspline", "catmullRom"])
@given(counts=st.lists(st.integers(0, 13), min_size=1, max_size=5))
def test_weights_sum_to_one_and_segments_are_the_schemas(basis: str, wrap: str, counts: list[int]) -> None:
    kind, step = Kind(basis, wrap), 3 if basis == "bezier" else 1
    samples = sample_curves(kind, np.array(counts), sum(counts), 4)
    np.testing.assert_allclose(samples.vertex @ np.ones(sum(counts)), 1.0, atol=1e-12)
    np.testing.assert_allclose(
        samples.varying @ np.ones(kind.elements(np.array(counts), sum(counts))["varying"]), 1.0, atol=1e-12
    )
    for count, segments in zip(counts, kind.segments(np.array(counts)), strict=True):
        if basis == "linear":
            due = count if wrap == "periodic" else count - 1
        elif wrap == "periodic":
            due = count // step
        else:
            due = count - 1 if wrap == "pinned" and step == 1 else (count - 4) // step + 1
        assert segments in (due, 0) and segments >= 0


def test_a_bspline_is_scipys() -> None:
    points = np.random.default_rng(1).random((7, 3))
    spline = BSpline(np.arange(-3.0, 8.0), points, 3)
    np.testing.assert_allclose(centres("bspline", "nonperiodic", points), spline(np.linspace(0, 4, 33)), atol=1e-12)


def test_beziers_and_catmull_rom_pass_through_their_points() -> None:
    points = np.random.default_rng(2).random((7, 3))
    np.testing.assert_allclose(centres("bezier", "nonperiodic", points)[::8], points[::3], atol=1e-12)
    np.testing.assert_allclose(centres("catmullRom", "nonperiodic", points)[::8], points[1:-1], atol=1e-12)
    np.testing.assert_allclose(centres("catmullRom", "periodic", points)[::8], np.roll(points, -1, axis=0), atol=1e-12)


@pytest.mark.parametrize("basis", ["bspline", "catmullRom"])
@pytest.mark.parametrize("count", [2, 3, 6])
def test_pinned_curves_begin_and_end_at_their_points(basis: str, count: int) -> None:
    points = np.random.default_rng(count).random((count, 3))
    sampled = centres(basis, "pinned", points)
    np.testing.assert_allclose(sampled[[0, -1]], points[[0, -1]], atol=1e-12)
    assert len(sampled) == 8 * (count - 1) + 1


# Tubes and ribbons


def test_a_tube_is_round_and_faces_outwards() -> None:
    drawn = read(curves(LINE, [4], "catmullRom", "pinned", width=0.5))
    np.testing.assert_allclose(distances(drawn), 0.25, rtol=1e-5)
    np.testing.assert_allclose(drawn.mesh.bounds[:, 2], [0, 3], atol=1e-6)
    a, b, c = drawn.mesh.points[drawn.mesh.triangles].astype(float).swapaxes(0, 1)
    outward = np.einsum("ti,ti->t", np.cross(b - a, c - a), drawn.mesh.normals[drawn.mesh.triangles[:, 0]])
    assert (outward > 0).all() and not drawn.issues
    np.testing.assert_allclose(drawn.mesh.normals[:, :2] * 0.25, drawn.mesh.points[:, :2], atol=1e-6)


ARC = [(1, 0, 0), (1, 0.5523, 0), (0.5523, 1, 0), (0, 1, 0)]
"""Of a quarter circle, from which it departs by 3e-4."""


def test_few_curves_bend_smoothly_and_many_keep_to_the_budget() -> None:
    """Chords of 1/32 of a right angle are 3e-4 of its radius within the arc."""
    drawn = read(curves(ARC, [4], "bezier", width=0.02))
    middles = drawn.mesh.points[drawn.mesh.triangles].mean(axis=1)
    np.testing.assert_allclose(np.linalg.norm(middles, axis=1), 1, atol=0.0105)
    assert len(drawn.mesh.triangles) == 2 * 32 * 24
    many = read(curves(ARC * 1000, [4] * 1000, "bezier", width=0.02))
    assert len(many.mesh.triangles) == 2 * 8 * 12 * 1000


def test_widths_vary_along_the_curve() -> None:
    schema = curves(LINE, [4], "linear", width=None)
    schema.CreateWidthsAttr([0.2, 0.4, 0.6, 0.8])
    schema.SetWidthsInterpolation("vertex")
    drawn = read(schema)
    np.testing.assert_allclose(distances(drawn), (drawn.mesh.points[:, 2] + 1) / 10, rtol=1e-5)


@pytest.mark.parametrize("basis", ["linear", "bspline", "catmullRom"])
def test_closed_curves_close(basis: str) -> None:
    drawn = read(curves(SQUARE, [4], basis, "periodic"))
    sides = np.stack([drawn.mesh.triangles, np.roll(drawn.mesh.triangles, -1, axis=1)], axis=-1)
    edges = np.sort(sides.reshape(-1, 2), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert (uses == 2).all()


@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=4, max_size=12), st.sampled_from(["pinned", "periodic"]))
def test_no_curve_is_bad_enough_for_a_broken_tube(points: list, wrap: str) -> None:
    drawn = read(curves(points, [len(points)], "bspline", wrap, width=0.02))
    assert np.isfinite(drawn.mesh.points).all()
    np.testing.assert_allclose(np.linalg.norm(drawn.mesh.normals, axis=1), 1, atol=1e-5)


def test_a_straight_tube_carries_its_frame_unturned() -> None:
    points = read(curves(LINE, [4], "linear")).mesh.points.reshape(4, -1, 3)
    np.testing.assert_allclose(points[:, :, :2], np.broadcast_to(points[:1, :, :2], points[:, :, :2].shape), atol=1e-6)


def test_bends_keep_the_width_of_straight_parts() -> None:
    """A ribbon around a right angle: its outer edge turns at the corner of the square, √2 half widths away."""
    schema = curves([(-2, 0, 0), (0, 0, 0), (0, -2, 0)], [3], "linear", width=0.5)
    schema.CreateNormalsAttr([(0, 0, 1)])
    schema.SetNormalsInterpolation("constant")
    np.testing.assert_allclose(read(schema).mesh.bounds, [[-2, -2, 0], [0.25, 0.25, 0]], atol=1e-6)


def test_normals_make_ribbons() -> None:
    schema = curves(LINE, [4], "linear", width=0.5)
    schema.CreateNormalsAttr([(1, 0, 0)] * 4)
    schema.SetNormalsInterpolation("vertex")
    drawn = read(schema)
    assert len(drawn.mesh.triangles) == 6
    np.testing.assert_allclose(drawn.mesh.bounds, [[0, -0.25, 0], [0, 0.25, 3]], atol=1e-6)
    np.testing.assert_allclose(drawn.mesh.normals, [[1, 0, 0]] * 8, atol=1e-6)
    a, b, c = drawn.mesh.points[drawn.mesh.triangles].swapaxes(0, 1)
    assert (np.cross(b - a, c - a)[:, 0] > 0).all()


# What lies on curves


@pytest.mark.parametrize(
    ("interpolation", "values"), [("uniform", [0, 1]), ("vertex", [0] * 4 + [1] * 5), ("varying", [0] * 2 + [1] * 3)]
)
def test_colours_lie_on_their_curves(interpolation: str, values: list[int]) -> None:
    schema = curves(LINE + [(1, 0, z) for z in range(5)], [4, 5])
    set_primvar(schema, "displayColor", [(v, 0, 0) for v in values], interpolation)
    drawn = read(schema)
    due = (drawn.mesh.points[:, 0] > 0.5).astype(float)
    np.testing.assert_allclose(drawn.mesh.display_color[:, 0], due, atol=1e-6)
    assert np.unique(drawn.mesh.faces).tolist() == [0, 1]


def test_coordinates_vary_along_the_curve() -> None:
    schema = curves(LINE, [4], "linear")
    set_primvar(schema, "st", [(0, 0), (0, 1), (0, 2), (0, 3)], "varying", "texCoord2f[]")
    mesh = read(schema).mesh
    np.testing.assert_allclose(mesh.uvs["st"][:, 1], mesh.points[:, 2], atol=1e-6)


# What is wrong


@pytest.mark.parametrize(
    ("points", "counts", "reason"),
    [
        (LINE, [], "it has no curves"),
        (LINE, [3], "1 curves are left out: they have too few points, or cannot be closed"),
        (LINE, [4, 4], "1 curves are left out: points ends before them"),
        ([(np.nan, 0, 0), *LINE], [5], "not all of its points are finite"),
        (LINE, [-4], "1 curves are left out: they have too few points, or cannot be closed"),
    ],
)
def test_bad_curves_are_left_out_and_said(points: list, counts: list[int], reason: str) -> None:
    drawn = read(curves(points, counts))
    assert any(reason in said for said in reasons(drawn))


def test_many_curves_are_drawn_with_less_detail() -> None:
    count = 20_000
    drawn = read(curves(np.tile(LINE, (count, 1)), [4] * count, "bezier"))
    assert count < len(drawn.mesh.triangles) < 4_000_000


def test_moving_curves_vary() -> None:
    schema = curves(LINE, [4])
    assert not is_time_varying(schema.GetPrim())
    schema.GetWidthsAttr().Set([1.0], 1.0)
    schema.GetWidthsAttr().Set([2.0], 2.0)
    assert is_time_varying(schema.GetPrim())


def test_curves_that_cannot_be_closed_are_open_and_it_is_said() -> None:
    """A periodic Bézier curve takes three points a segment: of four it makes one, open, as in Hydra."""
    drawn = read(curves([(0, 0, -1), (-1, 0, -0.5), (-1, 0, 0.5), (0, 0, 1)], [4], "bezier", wrap="periodic"))
    ends = drawn.mesh.points[np.abs(np.abs(drawn.mesh.points[:, 2]) - 1.0) < 0.5]
    assert len(drawn.mesh.triangles) and len(ends)
    assert "its curves are drawn open: they have too few points to be closed, or some too many" in reasons(drawn)
