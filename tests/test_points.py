"""Points as spheres, one placed at each."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd

import stages
from defshade_cli.scene.scene import Scene
from defshade_cli.usd.surfaces.varying import is_time_varying
from prims import reasons, try_read
from stages import instance

CLOUD = """def Points "dust" {
    point3f[] points = [(0, 0, 0), (1, 2, 3), (5, 0, 0)]
    WIDTHS
}
"""


def read(body: str) -> Scene:
    return stages.read(CLOUD.replace("WIDTHS", body))


def test_a_point_is_a_sphere_of_its_width() -> None:
    scene = read("float[] widths = [1, 0.5, 2]")
    (drawable,) = scene.drawables
    np.testing.assert_array_equal(drawable.world_from_object[:, :3, 3], [[0, 0, 0], [1, 2, 3], [5, 0, 0]])
    np.testing.assert_allclose(np.linalg.norm(scene.meshes[0].points, axis=1), 0.5, rtol=1e-6)
    np.testing.assert_allclose(drawable.world_from_object[:, 0, 0], [1, 0.5, 2])
    assert drawable.paths == ("/dust",) and drawable.instance_ids.tolist() == [0, 1, 2]
    np.testing.assert_allclose(scene.bounds, [[-0.5, -1, -1], [6, 2.25, 3.25]])


@pytest.mark.parametrize(
    ("authored", "diameter"),
    [
        ("float[] widths = [0.25]", 0.25),
        ('float[] primvars:widths = [0.5] (interpolation = "constant")', 0.5),
        ("", 1.0),
    ],
)
def test_one_width_serves_all(authored: str, diameter: float) -> None:
    scene = read(authored)
    np.testing.assert_allclose(scene.drawables[0].world_from_object[:, 0, 0], diameter)
    assert bool(stages.reasons(scene, "/dust")) == (not authored)


def test_colours_are_one_a_point_or_everyones() -> None:
    each = read('color3f[] primvars:displayColor = [(1,0,0),(0,1,0),(0,0,1)] (interpolation = "vertex")')
    np.testing.assert_array_equal(each.drawables[0].display_color, np.eye(3))
    same = read('color3f[] primvars:displayColor = [(1,0,0)] (interpolation = "constant")')
    np.testing.assert_array_equal(same.drawables[0].display_color, [[1, 0, 0]] * 3)


def test_instances_of_points_are_points_of_instances() -> None:
    text = 'class Xform "tree" {\n' + CLOUD.replace("WIDTHS", "float[] widths = [1]") + "}\n"
    scene = stages.read(text + instance("a", stages.move(10)) + instance("b", stages.move(20)))
    (drawable,) = scene.drawables
    assert drawable.world_from_object[:, 0, 3].tolist() == [10, 11, 15, 20, 21, 25]
    assert drawable.paths[0] == "/a/dust" and drawable.paths[-1] == "/b/dust"


def test_points_that_are_nowhere_are_left_out_and_said() -> None:
    text = CLOUD.replace("WIDTHS", "float[] widths = [1]").replace("(1, 2, 3)", "(nan, 0, 0)")
    scene = stages.read(text)
    assert scene.drawables[0].instance_ids.tolist() == [0, 2]
    assert "1 points are left out: they are not finite" in stages.reasons(scene, "/dust")


def test_empty_clouds_have_nothing_to_draw() -> None:
    stage = stages.stage_of('def Points "dust" {}')
    drawn = try_read(stage.GetPrimAtPath("/dust"), Usd.TimeCode.Default())
    assert drawn is not None and not drawn.surface.groups and "it has no points" in reasons(drawn)


def test_moving_points_make_the_prim_vary() -> None:
    text = 'def Points "dust" {{\npoint3f[] points{}\n}}'
    still = stages.stage_of(text.format(" = [(0, 0, 0)]"))
    moving = stages.stage_of(text.format(".timeSamples = {1: [(0,0,0)], 2: [(1,0,0)]}"))
    assert not is_time_varying(still.GetPrimAtPath("/dust"))
    assert is_time_varying(moving.GetPrimAtPath("/dust"))


def test_points_stay_round_under_any_scale() -> None:
    """As wide as in RenderMan and Hydra: by the length of what (1, 1, 1) / √3 becomes."""
    scene = read(
        "float[] widths = [1, 0.5, 2]\n    float3 xformOp:scale = (0.5, -0.5, 1)\n"
        '    uniform token[] xformOpOrder = ["xformOp:scale"]'
    )
    wide = np.sqrt((0.25 + 0.25 + 1.0) / 3.0)
    placed = scene.drawables[0].world_from_object
    np.testing.assert_allclose(placed[:, :3, :3], np.array([1, 0.5, 2])[:, None, None] * wide * np.eye(3), rtol=1e-6)
    np.testing.assert_allclose(placed[1, :3, 3], [0.5, -1.0, 3.0])
