"""How often surfaces are refined: by their size in the image, within a budget, or all alike."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pxr import Usd

import stages
from build import at, camera
from defshade_cli.plan import make_plan
from defshade_cli.scene.closed import is_closed
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.view import View
from defshade_cli.settings import COMPLEXITIES, RenderSettings
from defshade_cli.usd.gprims.revolution import SEGMENTS
from defshade_cli.usd.polygons.flatness import rises
from defshade_cli.usd.surfaces import complexity
from defshade_cli.usd.surfaces.complexity import (
    EDGE_PIXELS,
    FEWEST_SEGMENTS,
    FINEST_LEVEL,
    FLAT_PIXELS,
    choose_levels,
)
from defshade_cli.usd.surfaces.geometry import Surface, read_surface, tessellate
from prims import define_cube, define_mesh
from stages import move

BALL = """def Mesh "ball" {
    point3f[] points = [(-1,-1,-1),(-1,-1,1),(-1,1,-1),(-1,1,1),(1,-1,-1),(1,-1,1),(1,1,-1),(1,1,1)]
    int[] faceVertexCounts = [4,4,4,4,4,4]
    int[] faceVertexIndices = [0,1,3,2, 4,6,7,5, 0,4,5,1, 2,3,7,6, 0,2,6,4, 1,5,7,3]
    MOVE
}
"""
CAMERA = 'def Camera "cam" { float2 clippingRange = (0.1, 1000)\n MOVE\n}\n'


def ball() -> Surface:
    surface = read_surface(define_cube("catmullClark").GetPrim(), Usd.TimeCode.Default())
    assert surface is not None
    return surface


def view(height: int = 100) -> View:
    return View(camera(5.0), height)


def levels_of(scene: Scene) -> list[int | None]:
    return [mesh.level for mesh in scene.meshes]


@pytest.mark.parametrize("height", [1, 2, 8, 30, 100, 1000])
def test_auto_refines_until_edges_are_short_or_the_surface_is_flat(height: int) -> None:
    """The face nearest to the eye is 4 away, its edge 2 long, and a unit there height / 4 pixels.

    The normals at a cube's corners are along its diagonals, whose cosine is 1/3.
    """
    surface = ball()
    edge, rise = 2 * height / 4, height / 4 * 2 * math.acos(1 / 3) / 8
    short, flat = math.log2(max(edge / EDGE_PIXELS, 1)), math.log2(max(rise / FLAT_PIXELS, 1)) / 2
    level = choose_levels([(surface, np.eye(4)[None])], "auto", view(height))[surface]
    assert level == min(math.ceil(min(short, flat)), FINEST_LEVEL)


@pytest.mark.parametrize(
    ("scheme", "lifted", "level"), [("catmullClark", 0, 0), ("bilinear", 0, 0), ("bilinear", 1, 4)]
)
def test_what_is_flat_needs_no_refinement(scheme: str, lifted: float, level: int) -> None:
    quad = define_mesh([[-1, -1, 0], [1, -1, 0], [1, 1, lifted], [-1, 1, 0]], [[0, 1, 2, 3]], scheme)
    surface = read_surface(quad.GetPrim(), Usd.TimeCode.Default())
    assert surface is not None
    assert choose_levels([(surface, np.eye(4)[None])], "auto", view(400))[surface] == level


def test_the_rise_is_that_of_the_surface() -> None:
    """Around a cylinder of n sides, the chord is r (1 − cos(π/n)) from the arc; the cage is outside by as much more."""
    turn = np.linspace(0, 2 * math.pi, 33)[:-1]
    rim = np.column_stack([np.cos(turn), np.sin(turn)])
    points = np.concatenate([np.column_stack([rim, np.full(32, z)]) for z in (0, 0.2)])
    faces = [[i, (i + 1) % 32, 32 + (i + 1) % 32, 32 + i] for i in range(32)]
    surface = read_surface(define_mesh(points, faces, "catmullClark").GetPrim(), Usd.TimeCode.Default())
    assert surface is not None
    assert rises([surface.polygons]) == pytest.approx([1 - math.cos(math.pi / 32)], rel=0.05)


def test_the_nearest_and_largest_instance_counts() -> None:
    surface = ball()
    far = at(0, 0, -1000)
    near = np.stack([far, np.eye(4)])
    assert choose_levels([(surface, far[None])], "auto", view())[surface] == 0
    both = choose_levels([(surface, far[None]), (surface, near)], "auto", view())
    assert both == choose_levels([(surface, np.eye(4)[None])], "auto", view())
    enlarged = far @ np.diag([300.0, 300.0, 300.0, 1.0])
    assert choose_levels([(surface, enlarged[None])], "auto", view())[surface] > 3


def test_a_camera_inside_a_surface_sees_it_as_fine_as_it_gets() -> None:
    surface = ball()
    assert choose_levels([(surface, at(0, 0, 5)[None])], "auto", view())[surface] == FINEST_LEVEL


def test_distance_is_of_no_account_without_perspective() -> None:
    surface, flat = ball(), View(camera(5.0, 10.0, projection="orthographic"), 100)
    assert choose_levels([(surface, np.eye(4)[None])], "auto", flat)[surface] == 2
    assert choose_levels([(surface, at(0, 0, -900)[None])], "auto", flat)[surface] == 2


def test_the_budget_goes_to_the_longest_edges(monkeypatch: pytest.MonkeyPatch) -> None:
    near, far = ball(), ball()
    placed = [(far, at(0, 0, -60)[None]), (near, np.eye(4)[None])]
    free = choose_levels(placed, "auto", view(1000))
    monkeypatch.setattr(complexity, "TRIANGLE_BUDGET", 3000)
    bounded = choose_levels(placed, "auto", view(1000))
    assert free[near] > bounded[near] >= bounded[far]
    assert sum(s.control.triangle_count(level) for s, level in bounded.items() if s.control) <= 3000


@pytest.mark.parametrize("name", COMPLEXITIES[1:])
def test_a_fixed_complexity_is_the_same_everywhere(name: str) -> None:
    surface = ball()
    polygons = read_surface(
        define_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).GetPrim(), Usd.TimeCode.Default()
    )
    found = choose_levels([(surface, at(0, 0, -1000)[None]), (polygons, np.eye(4)[None])], name, view())
    assert found == {surface: COMPLEXITIES.index(name) - 1, polygons: 0}


def test_triangles_are_counted_as_they_are_made() -> None:
    scene = stages.read(BALL.replace("MOVE", ""), complexity="high")
    assert scene.triangle_count == 6 * 4 * 2 * 4


def test_stages_are_refined_by_the_image_that_is_asked_for() -> None:
    text = CAMERA.replace("MOVE", move(z=10)) + BALL.replace("MOVE", "")
    small, large = (stages.read(text, size=(n, n)) for n in (16, 512))
    assert levels_of(small) < levels_of(large)
    decided = {d.subject: d for d in make_plan(large, RenderSettings(size=(512, 512))).decisions}
    assert decided["subdivision"].choice == f"{levels_of(large)[0]} levels"
    assert "size in the image" in decided["subdivision"].reason


def test_our_camera_frames_the_same_however_fine_the_surface_is() -> None:
    frames = [stages.read(BALL.replace("MOVE", ""), complexity=name).camera for name in COMPLEXITIES]
    assert all(np.array_equal(frame.world_from_camera, frames[0].world_from_camera) for frame in frames)


# Solids

SOLIDS = {
    "Sphere": "double radius = 1",
    "Cylinder": 'double radius = 1\ndouble height = 4\ntoken axis = "X"',
    "Cone": 'double radius = 1\ndouble height = 2\ntoken axis = "Z"',
    "Capsule": 'double radius = 1\ndouble height = 2\ntoken axis = "Y"',
}


def solid(kind: str) -> Surface:
    stage = stages.stage_of(f'def {kind} "solid" {{\n{SOLIDS[kind]}\n}}')
    surface = read_surface(stage.GetPrimAtPath("/solid"), Usd.TimeCode.Default())
    assert surface is not None
    return surface


@pytest.mark.parametrize("kind", SOLIDS)
@pytest.mark.parametrize("height", [1, 10, 40, 200, 1000, 4000])
def test_many_solids_are_as_round_as_can_be_seen(kind: str, height: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A circle is r (1 - cos(pi / n)) from its polygon: within FLAT_PIXELS, and half as many sides would be beyond."""
    monkeypatch.setattr(complexity, "MANY_TRIANGLES", 0)
    surface = solid(kind)
    level = choose_levels([(surface, at(0, 0, -95)[None])], "auto", view(height))[surface]
    nearest = 100.0 - surface.polygons.bounds[1, 2]
    segments, radius = SEGMENTS >> -level, height / nearest
    assert radius * (1.0 - math.cos(math.pi / segments)) <= FLAT_PIXELS or segments == SEGMENTS
    assert radius * (1.0 - math.cos(2.0 * math.pi / segments)) > FLAT_PIXELS or segments == FEWEST_SEGMENTS


@pytest.mark.parametrize("kind", SOLIDS)
def test_a_coarse_solid_has_its_corners_on_the_round_one(kind: str) -> None:
    surface = solid(kind)
    fine, coarse = tessellate(surface).mesh, tessellate(surface, level=-2).mesh
    assert coarse.level == -2 and fine.level is None
    assert 2 * len(coarse.triangles) < len(fine.triangles)
    np.testing.assert_allclose(coarse.bounds, fine.bounds, atol=1e-6)
    apart = np.linalg.norm(coarse.points[:, None] - fine.points[None], axis=-1).min(axis=1)
    assert apart.max() < 1e-5
    assert is_closed(coarse.points, coarse.triangles)


def test_few_solids_and_those_that_shine_are_round(monkeypatch: pytest.MonkeyPatch) -> None:
    far = [(solid("Sphere"), at(0, 0, -900)[None])]
    assert set(choose_levels(far, "auto", view()).values()) == {0}
    monkeypatch.setattr(complexity, "MANY_TRIANGLES", 0)
    assert set(choose_levels(far, "auto", view()).values()) == {-3}
    assert set(choose_levels(far, "auto", view(), {"/solid"}).values()) == {0}
    assert set(choose_levels(far, "medium", view()).values()) == {0}


def test_a_crowd_of_solids_takes_few_triangles_and_keeps_its_colour() -> None:
    places = ", ".join(f"({x}, {y}, 0)" for x in range(0, 60, 3) for y in range(0, 60, 3))
    ball = 'def Sphere "ball" {\ncolor3f[] primvars:displayColor = [(0.1, 0.2, 0.3)]\n}'
    text = f"""def PointInstancer "crowd" {{
        rel prototypes = </crowd/ball>
        int[] protoIndices = {[0] * 400}
        point3f[] positions = [{places}]
        {ball}
    }}
    """
    scene = stages.read(text, size=(96, 54))
    assert scene.triangle_count == 400 * (FEWEST_SEGMENTS * (FEWEST_SEGMENTS // 2 - 1) * 2)
    np.testing.assert_allclose(scene.drawables[0].display_color, np.tile([0.1, 0.2, 0.3], (400, 1)), rtol=1e-6)
    (said,) = (d for d in make_plan(scene, RenderSettings()).decisions if d.subject == "coarse solids")
    assert said.choice == "1 meshes"
