"""Points and curves at a fixed complexity: they face the image, as Hydra draws them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stages
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import Complexity
from defshade_cli.usd.curves.strands import fractional_odd
from stages import instance, move

CAMERA = """def Camera "eye" {
    float focalLength = 10
    float horizontalAperture = 20
    float verticalAperture = 20
    float2 clippingRange = (0.1, 1000)
    PLANES
    double3 xformOp:translate = (0, 0, 10)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
PIXELS_PER_UNIT = 10.0
"""On the plane z = 0: 200 pixels show 20 units."""


def read(text: str, complexity: Complexity, planes: str = "") -> Scene:
    return stages.read(CAMERA.replace("PLANES", planes) + text, complexity=complexity, size=(200, 200))


def curves(points: str, basis: str = "linear", more: str = "") -> str:
    kind = 'uniform token type = "linear"' if basis == "linear" else f'uniform token basis = "{basis}"'
    count = points.count("(")
    return f"""def BasisCurves "hair" {{
    {kind}
    int[] curveVertexCounts = [{count}]
    point3f[] points = [{points}]
    float[] widths = [2] (interpolation = "constant")
    {more}
}}
"""


def cloud(widths: str) -> str:
    return f'def Points "dust" {{\npoint3f[] points = [(0, 0, 0), (6, 0, 0)]\nfloat[] widths = {widths}\n}}\n'


def world_points(scene: Scene) -> np.ndarray:
    """(V, 3) of the first drawable's first instance."""
    drawable = scene.drawables[0]
    placed = drawable.world_from_object[0]
    return scene.meshes[drawable.mesh].points @ placed[:3, :3].T + placed[:3, 3]


# Points


@pytest.mark.parametrize(
    ("width", "pixels"),
    [(4.0, 39.0), (2.0, 19.0), (0.4, 4.0 + 0.0825 * 12.0 - 1.0), (0.01, 0.1 + 0.0825 * 15.9 - 1.0), (50.0, 99.0)],
)
def test_a_point_is_a_disk_across_the_view(width: float, pixels: float) -> None:
    scene = read(cloud(f"[{width}]"), "low")
    points = world_points(scene)
    np.testing.assert_allclose(points[:, 2], 0.0, atol=1e-6)
    np.testing.assert_allclose(np.ptp(points[:, 0]) * PIXELS_PER_UNIT, pixels, rtol=1e-5)
    (drawable,) = scene.drawables
    assert drawable.world_from_object.shape == (2, 4, 4)


def test_a_point_is_clipped_as_a_whole_by_its_centre() -> None:
    planes = "float4[] clippingPlanes = [(-1, 0, 0, 5)]"
    (drawable,) = read(cloud("[4]"), "low", planes).drawables
    assert drawable.instance_ids.tolist() == [0]
    assert read(cloud("[4]") + 'def Cube "c" {}', "low", planes.replace("5)", "-1)")).drawables[0].paths == ("/c",)


def test_all_else_stays_as_it_is() -> None:
    (drawable,) = read(cloud("[4]"), "auto").drawables
    np.testing.assert_array_equal(drawable.world_from_object[0, :3, :3], 4.0 * np.eye(3))
    tube = read(curves("(0, 0, 0), (0, 5, 0)"), "auto")
    assert np.ptp(world_points(tube)[:, 2]) > 1.0


# Curves


@pytest.mark.parametrize("basis", ["linear", "bezier", "bspline", "catmullRom"])
def test_low_draws_lines_of_a_pixel_along_the_control_points(basis: str) -> None:
    scene = read(curves("(-5, 0, 0), (0, 0, 0), (0, 5, 0), (5, 5, 0)", basis), "low")
    points = world_points(scene).reshape(3, 4, 3)
    half = 0.5 / PIXELS_PER_UNIT
    np.testing.assert_allclose(points.min(axis=1), [[-5, -half, 0], [-half, 0, 0], [0, 5 - half, 0]], atol=1e-5)
    np.testing.assert_allclose(points.max(axis=1), [[0, half, 0], [half, 5, 0], [5, 5 + half, 0]], atol=1e-5)


def test_lines_that_recede_are_a_pixel_wide_everywhere() -> None:
    points = world_points(read(curves("(1, 0, 0), (1, 0, 5)"), "low"))
    seen = points[:, :2] / (10.0 - points[:, 2:]) * 100.0
    assert np.ptp(seen[:, 1].reshape(2, 2), axis=1) == pytest.approx([1.0, 1.0], abs=1e-5)


@pytest.mark.parametrize("complexity", ["auto", "low", "medium", "veryhigh"])
def test_curves_without_widths_are_lines_of_a_pixel(complexity: Complexity) -> None:
    bare = curves("(-5, 0, 0), (5, 0, 0)").replace('float[] widths = [2] (interpolation = "constant")', "")
    scene = read(bare, complexity)
    np.testing.assert_allclose(np.abs(world_points(scene)).max(axis=0), [5, 0.05, 0], atol=1e-6)
    assert stages.reasons(scene, "/hair") == ["no widths that fit: its curves are drawn as lines one pixel wide"]


def test_periodic_lines_are_closed() -> None:
    closed = curves("(0, 0, 0), (3, 0, 0), (3, 3, 0)", more='uniform token wrap = "periodic"')
    assert len(world_points(read(closed, "low"))) == 3 * 4


@pytest.mark.parametrize(("complexity", "across"), [("medium", 2), ("high", 7)])
def test_medium_and_high_draw_ribbons_that_face_the_image(complexity: Complexity, across: int) -> None:
    scene = read(curves("(-6, 0, 0), (6, 0, 0)"), complexity)
    points = world_points(scene)
    assert len(points) == 2 * across
    np.testing.assert_allclose(np.abs(points).max(axis=0), [6, 1, 0], atol=1e-5)
    normals = scene.meshes[0].normals.reshape(2, across, 3)
    np.testing.assert_allclose(normals[:, across // 2 if across > 2 else slice(None), 2], 1.0, atol=1e-6)
    assert across == 2 or np.abs(normals[:, [0, -1], 1]) == pytest.approx(1.0)


def test_a_ribbon_has_a_piece_for_each_20_pixels() -> None:
    scene = read(curves("(-5, 0, 0), (-2, 0, 0), (2, 0, 0), (5, 0, 0)", "bezier"), "medium")
    assert scene.triangle_count == 2 * 5


def test_what_lies_on_curves_stays_with_them() -> None:
    color = 'color3f[] primvars:displayColor = [(1, 0, 0), (0, 0, 1)] (interpolation = "vertex")'
    for complexity in ("low", "medium"):
        scene = read(curves("(-5, 0, 0), (5, 0, 0)", more=color), complexity)
        found = scene.meshes[0].display_color
        assert found is not None
        np.testing.assert_allclose(found, np.where(world_points(scene)[:, :1] < 0, [[1, 0, 0]], [[0, 0, 1]]))


def test_every_instance_of_curves_is_seen_from_its_own_side() -> None:
    tree = 'class Xform "tree" {\n' + curves("(0, 0, 0), (0, 1, 0)") + "}\n"
    scene = read(tree + instance("a", move(z=0)) + instance("b", move(z=5)), "low")
    widths = [np.ptp(scene.meshes[drawable.mesh].points[:, 0]) for drawable in scene.drawables]
    assert widths == pytest.approx([0.1, 0.05], rel=1e-5)
    assert [drawable.paths for drawable in scene.drawables] == [("/a/hair",), ("/b/hair",)]


# How OpenGL cuts a fraction of pieces


@given(st.lists(st.floats(1.0, 39.0, width=32), min_size=1, max_size=5))
def test_pieces_are_the_next_odd_number_and_all_but_two_of_one_length(levels: list[float]) -> None:
    row, places = fractional_odd(np.array(levels))
    for edge, level in enumerate(levels):
        place = places[row == edge]
        lengths = np.diff(place)
        assert place[0] == 0.0 and place[-1] == 1.0
        assert len(lengths) % 2 == 1 and level <= len(lengths) < level + 2.0
        np.testing.assert_allclose(lengths, lengths[::-1], atol=1e-12)
        longest = lengths.max()
        assert np.sum(lengths < longest - 1e-9) in (0, 2)
