"""Ids of prims, instances, faces and materials: whole, and those of what is seen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from build import camera, drawable, quad, scene, sphere, sun
from defshade_cli import render
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.draw_list import draw_commands
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.geometry import Subset
from defshade_cli.scene.identity import Identities
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings
from defshade_cli.spaces import translation

IDS = ("primId", "instanceId", "elementId", "materialId")
LEFT, RIGHT = translation(np.array([-1.2, 0, 0])), translation(np.array([1.2, 0, 0]))

CUBE = """#usda 1.0
def Mesh "cube" {
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]
    point3f[] points = [(-1,-1,-1), (-1,-1,1), (-1,1,-1), (-1,1,1), (1,-1,-1), (1,-1,1), (1,1,-1), (1,1,1)]
    uniform token subdivisionScheme = "SCHEME"
    float3 xformOp:rotateXYZ = (35, -40, 0)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
}
"""
FACES = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]])
"""The way that each of the cube's faces looks."""


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def two_kinds() -> Scene:
    """Two instances of a quad of two materials, each with a face of its own, before them a ball."""
    halves = replace(quad(1.0), path="/card", faces=[7, 9])
    cards = replace(
        drawable(halves, where=[LEFT, RIGHT]),
        subsets=(Subset(1, 0, 1), Subset(0, 1, 1)),
        paths=("/left/card", "/right/card"),
        instance_ids=[4, 6],
    )
    ball = replace(drawable(sphere(0.3), 1, material=1), paths=("/ball",), instance_ids=[-1])
    materials = [Material("/paint"), Material("/wood")]
    return scene([halves, sphere(0.3)], [sun()], materials, camera(5.0), [cards, ball])


def drawn(pipeline: Pipeline, of: Scene, *layers: str, **options: object) -> dict[str, NDArray[np.float32]]:
    return pipeline.render(of, make_plan(of, RenderSettings(size=(64, 64), layers=layers, **options))).layers  # type: ignore[arg-type]


def at(layers: dict[str, NDArray[np.float32]], row: int, column: int) -> tuple[int, ...]:
    return tuple(int(layers[name][row, column, 0]) for name in IDS)


@pytest.mark.parametrize("options", [{}, {"samples": 4}, {"layout": "rgba8"}])
def test_ids_are_those_of_what_is_seen(pipeline: Pipeline, options: dict[str, object]) -> None:
    """Quads from -2.2 to -0.2 and 0.2 to 2.2 of 5 across 64 pixels, cut from the lower left to the upper right."""
    layers = drawn(pipeline, two_kinds(), "beauty", *IDS, **options)
    assert at(layers, 40, 20) == (0, 4, 7, 1)
    assert at(layers, 24, 10) == (0, 4, 9, 0)
    assert at(layers, 40, 52) == (1, 6, 7, 1)
    assert at(layers, 32, 32) == (2, -1, 0, 1)
    assert at(layers, 1, 1) == (-1, -1, -1, -1)


def test_manifests_name_what_the_picture_shows(pipeline: Pipeline) -> None:
    of = replace(two_kinds(), camera=replace(camera(5.0), window=(-0.45, -0.1, -0.1, 0.1)))
    plan = make_plan(of, RenderSettings(size=(32, 16), layers=IDS))
    assert pipeline.render(of, plan).manifests == {"primId": {0: "/left/card"}, "materialId": {0: "/paint", 1: "/wood"}}


def test_rows_are_the_draw_lists(pipeline: Pipeline) -> None:
    of = two_kinds()
    identities, (_, rows) = Identities(of), draw_commands(of.drawables, of.meshes)
    every = np.concatenate([d.instance_ids for d in of.drawables])
    np.testing.assert_array_equal(identities.instance[1:], every[rows[:, 0]])
    np.testing.assert_array_equal(identities.material[1:], rows[:, 1])


def test_ids_without_anything_to_draw(pipeline: Pipeline) -> None:
    layers = drawn(pipeline, scene([], [sun()]), *IDS, "cryptoObject")
    assert all((layers[name] == -1).all() for name in IDS) and not layers["cryptoObject"].any()


@pytest.mark.parametrize(("scheme", "complexity"), [("none", "low"), ("catmullClark", "high"), ("bilinear", "medium")])
def test_elements_are_the_authored_faces(scheme: str, complexity: str, tmp_path: Path) -> None:
    """However a face was cut: of a cube's six, the one that looks the way of the point."""
    stage = tmp_path / "cube.usda"
    stage.write_text(CUBE.replace("SCHEME", scheme))
    film = render(stage, size=(64, 64), layers=("elementId", "position"), complexity=complexity)
    covered = film.layers["elementId"][..., 0] >= 0
    turned = np.linalg.inv(_rotation(35, -40))
    local = film.layers["position"][covered] @ turned.T
    sides = local @ FACES.T
    second, first = np.sort(sides, axis=1)[:, -2:].T
    clear = first > second + 0.02  # a limit surface has its borders of faces where the coordinates are equal
    assert clear.mean() > 0.9
    np.testing.assert_array_equal(film.layers["elementId"][covered][clear, 0], sides.argmax(axis=1)[clear])


def _rotation(x: float, y: float) -> NDArray[np.float64]:
    """rotateXYZ: about X first."""
    a, b = np.radians([x, y])
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    return about_y @ about_x


def test_the_visible_plane_is_there_for_ids_alone() -> None:
    of = two_kinds()
    for layer, samples, lit, data in (
        ("beauty", 1, False, False),
        ("primId", 1, False, True),
        ("cryptoObject", 4, True, False),
    ):
        plan = make_plan(of, RenderSettings(layers=(layer,), samples=samples))
        assert ("visible" in [plane.name for plane in plan.planes]) == lit
        assert ("visible" in [plane.name for plane in plan.data_planes]) == data
        assert ("DRAW_ROW" in plan.inputs) == (lit or data)
