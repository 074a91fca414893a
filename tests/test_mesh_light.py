"""Lights made of geometry: sampled by area, tinted by their materials, and seen as the mode says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from build import at, beauty, quad, rotated, scene
from build import sphere as ball
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan, volume_of
from defshade_cli.scene.emission import emitter_at
from defshade_cli.scene.light import SphereLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.mesh_light import MeshLight
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings
from defshade_cli.usd.lights.light import CAMERA_LIGHT
from stages import instance, read, reasons

WHITE = Material("/white", diffuse_color=(1, 1, 1), roughness=1.0, ior=1.0)
GRID = [((i + 0.5) / 400, (j + 0.5) / 8, 0.5) for i in range(400) for j in range(8)]
ORIGIN = np.zeros(3)


def triangles(count: int = 12) -> NDArray[np.float64]:
    return np.random.default_rng(4).normal(size=(count, 3, 3))


def mesh_light(corners: NDArray[np.float64], **options: object) -> MeshLight:
    defaults = {"path": "/lamp", "world_from_light": np.eye(4), "color": (1, 1, 1), "tints": np.ones((len(corners), 3))}
    return MeshLight(**defaults | options, corners=corners)  # type: ignore[arg-type]


def corners_of_ball(radius: float) -> NDArray[np.float64]:
    mesh = ball(radius)
    corners = mesh.points[mesh.triangles].astype(np.float64)
    return corners[np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) > 0]


def areas(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)


# Sampling


def test_its_spread_holds_all_of_the_surface() -> None:
    """So that several points stand for it at one sample, which its far field cannot."""
    light = mesh_light(corners_of_ball(0.5), world_from_light=at(0, 0, 3) @ np.diag([2.0, 1.0, 1.0, 1.0]))
    assert light.spread == pytest.approx(1.0, rel=1e-3)
    of = scene([ball(1.0)], [light], [WHITE])
    assert make_plan(of, RenderSettings(size=(8, 8))).lights[0].points == 16


@pytest.mark.parametrize("placed", [np.eye(4), at(1, 2, 3) @ rotated("x", 40.0) @ np.diag([2.0, 0.5, -3.0, 1.0])])
def test_points_carry_the_light_of_the_whole_surface(placed: NDArray[np.float64]) -> None:
    """The mean of what 3200 points stand for is ∫ L dA, and of their places ∫ L x dA: stretched, mirrored, tinted."""
    corners = triangles()
    tints = np.random.default_rng(1).random((12, 3))
    light = mesh_light(corners, tints=tints, world_from_light=placed, intensity=2.0)
    drawn = [emitter_at(light, u, ORIGIN) for u in GRID]
    world = corners @ placed[:3, :3].T + placed[:3, 3]
    power = areas(world) @ (2.0 * tints)
    np.testing.assert_allclose(np.mean([e.intensity for e in drawn], axis=0), power, rtol=0.02)
    moment = (areas(world)[:, None] * 2.0 * tints).T @ world.mean(axis=1)
    found = np.mean([e.intensity[:, None] * e.position for e in drawn], axis=0)
    np.testing.assert_allclose(found, moment, rtol=0.05, atol=0.03 * np.abs(moment).max())


def test_points_lie_on_their_triangles_and_face_outwards() -> None:
    corners = triangles(1)
    light = mesh_light(corners)
    a, b, c = corners[0]
    normal = np.cross(b - a, c - a)
    for u in GRID[::31]:
        emitter = emitter_at(light, u, ORIGIN)
        weights = np.linalg.solve(np.column_stack([a, b, c]), emitter.position)
        assert weights.min() >= -1e-9 and weights.sum() == pytest.approx(1)
        np.testing.assert_allclose(emitter.facing, normal / np.linalg.norm(normal), atol=1e-12)


def test_normalize_divides_by_the_area_in_the_world() -> None:
    corners = triangles()
    stretched = np.diag([1.0, 2.0, 3.0, 1.0])
    light = mesh_light(corners, normalize=True, world_from_light=stretched, intensity=5.0)
    assert light.size_factor == pytest.approx(areas(corners * [1, 2, 3]).sum())
    np.testing.assert_allclose(light.radiance * light.size_factor, 5.0)


def test_black_and_flat_triangles_give_nothing() -> None:
    light = mesh_light(triangles(2), tints=np.zeros((2, 3)))
    assert not emitter_at(light, GRID[0], ORIGIN).intensity.any() and volume_of(light) == "sphere"
    assert not emitter_at(mesh_light(np.zeros((1, 3, 3))), GRID[0], ORIGIN).intensity.any()


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def render(pipeline: Pipeline, of: Scene, **options: object) -> NDArray[np.float64]:
    plan = make_plan(of, RenderSettings(size=(32, 32), **options))  # type: ignore[arg-type]
    return beauty(pipeline.render(of, plan).layers)


@pytest.mark.parametrize("distance", [0.7, 1.5, 4.0])
def test_a_ball_of_triangles_lights_like_a_sphere(distance: float) -> None:
    """E = π L (r / d)² on a surface that faces it, from 4000 points; facets take 0.4 % of the area."""
    light = mesh_light(corners_of_ball(0.5), intensity=3.0)
    irradiance = 0.0
    places = [((i + 0.5) / 4000, i * 0.618034 % 1.0, 0.5) for i in range(4000)]
    for emitter in (emitter_at(light, u, ORIGIN) for u in places):
        to_light = emitter.position - np.array([0.0, 0.0, -distance])
        d = float(np.linalg.norm(to_light))
        leaving = max(-float(to_light @ emitter.facing) / d, 0.0)
        irradiance += float(emitter.intensity[0]) * leaving * to_light[2] / d**3 / len(places)
    assert irradiance == pytest.approx(3.0 * math.pi * (0.5 / distance) ** 2, rel=0.02)


def test_the_lighting_pass_draws_it(pipeline: Pipeline) -> None:
    """On the whole as bright as the sphere; the noise of 64 points, half of which face away from the wall."""
    shape = {"path": "/lamp", "world_from_light": at(0.2, 0.1, 1.2), "color": (1, 1, 1), "intensity": 3.0}
    lights = [SphereLight(**shape, radius=0.5), mesh_light(corners_of_ball(0.5), **shape)]  # type: ignore[arg-type]
    images = [render(pipeline, scene([quad(5.0)], [light], [WHITE]), samples=64, shadows=False) for light in lights]
    np.testing.assert_allclose(images[1].mean(), images[0].mean(), rtol=0.04)


# Stages

GLOW = """def Material "ember" {
    token outputs:surface.connect = </ember/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:emissiveColor = (1, 0.5, 0)
        token outputs:surface
    }
}
def Material "dull" {
    token outputs:surface.connect = </dull/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }
}
"""


def card(name: str = "card", api: str = "MeshLightAPI", body: str = "") -> str:
    return f"""def Mesh "{name}" (prepend apiSchemas = ["MaterialBindingAPI", "{api}"]) {{
        int[] faceVertexCounts = [4, 4]
        int[] faceVertexIndices = [0, 1, 2, 3, 1, 4, 5, 2]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)]
        uniform token subdivisionScheme = "none"
        float inputs:intensity = 4
        {body}
    }}
    """


def only_light(found: Scene) -> MeshLight:
    (light,) = found.lights
    assert isinstance(light, MeshLight)
    return light


def test_glow_tints_the_light_and_stays_what_is_seen() -> None:
    found = read(GLOW + card(body="rel material:binding = </ember>\ncolor3f inputs:color = (1, 1, 0.5)"))
    light = only_light(found)
    np.testing.assert_allclose(light.radiance, [4, 2, 0])
    assert (light.path, light.size_factor) == ("/card", pytest.approx(2))
    (subset,) = found.drawables[0].subsets
    assert found.materials[subset.material].emissive_color == (1, 0.5, 0)


def test_without_material_a_mesh_light_is_white_and_without_glow_black() -> None:
    np.testing.assert_allclose(only_light(read(card())).radiance, 4)
    dull = read(GLOW + card(body="rel material:binding = </dull>"))
    assert not only_light(dull).radiance.any() and not make_plan(dull, RenderSettings()).lights


def test_an_independent_light_keeps_its_own_colour() -> None:
    body = 'rel material:binding = </ember>\nuniform token light:materialSyncMode = "independent"'
    np.testing.assert_allclose(only_light(read(GLOW + card(body=body))).radiance, 4)


def test_without_material_response_the_surface_shows_its_light() -> None:
    found = read(GLOW + card(api="LightAPI", body="rel material:binding = </ember>\nbool inputs:normalize = 1"))
    (subset,) = found.drawables[0].subsets
    shown = found.materials[subset.material]
    assert shown.emissive_color == (2, 2, 2) and (shown.diffuse_color, shown.metallic) == ((0, 0, 0), 1)


def test_each_part_glows_by_its_own_material() -> None:
    parts = """rel material:binding = </dull>
        def GeomSubset "right" (prepend apiSchemas = ["MaterialBindingAPI"]) {
            uniform token familyName = "materialBind"
            int[] indices = [1]
            rel material:binding = </ember>
        }"""
    light = only_light(read(GLOW + card(body=parts)))
    np.testing.assert_allclose(light.emission, [2, 1, 0], err_msg="half of the surface glows")
    assert all(emitter_at(light, u, ORIGIN).position[0] >= 1 for u in GRID[::37])


def test_every_instance_is_a_light() -> None:
    tree = f'class Xform "tree" {{\n{card()}\n}}\n'
    move = 'double3 xformOp:translate = (5, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    found = read(tree + instance("a") + instance("b", move))
    assert {light.path: light.position.tolist() for light in found.lights} == {
        "/a/card": [1, 0.5, 0],
        "/b/card": [6, 0.5, 0],
    }


def test_a_geometry_light_shines_by_the_geometry_it_names() -> None:
    lamp = 'def GeometryLight "lamp" {\nrel geometry = </ball>\nfloat inputs:intensity = 3\n}\n'
    lamp += 'def GeometryLight "none" {\n}'
    found = read('def Sphere "ball" {\ndouble radius = 2\n}\n' + lamp)
    light = only_light(found)
    assert light.path == "/lamp" and light.size_factor == pytest.approx(16 * math.pi, rel=0.01)
    assert found.materials[0].emissive_color == pytest.approx((3, 3, 3))
    assert reasons(found, "/none") == ["it names no geometry"]


def test_points_are_no_lights() -> None:
    body = "point3f[] points = [(0, 0, 0)]\nfloat[] widths = [1]"
    found = read(f'def Points "dots" (prepend apiSchemas = ["LightAPI"]) {{\n{body}\n}}')
    assert [light.path for light in found.lights] == [CAMERA_LIGHT]
    assert reasons(found, "/dots") == ["lights of type Points are not supported yet"]


@pytest.mark.parametrize("samples", [1, 16])
def test_a_mesh_light_does_not_stand_in_its_own_light(pipeline: Pipeline, samples: int) -> None:
    """A closed ball around its own light: with shadows, the floor keeps nine tenths of the light."""
    text = """def Mesh "floor" {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-5, -1, 5), (5, -1, 5), (5, -1, -5), (-5, -1, -5)]
        uniform token subdivisionScheme = "none"
    }
    def Sphere "ball" (prepend apiSchemas = ["LightAPI"]) {
        double radius = 0.3
        float inputs:intensity = 5
    }
    def Camera "cam" {
        double3 xformOp:translate = (0, 9, 0)
        float xformOp:rotateX = -90
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
    }"""
    found = read(text)
    lit, free = (render(pipeline, found, samples=samples, shadows=shadows)[2, 2, 0] for shadows in (True, False))
    assert 0.9 * free < lit <= 1.1 * free
