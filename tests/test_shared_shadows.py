"""Shadows of a dome's directions that pixels look up for each other."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from build import quad, scene, sphere, sun
from defshade_cli import render
from defshade_cli.passes.shared_shadows import apart_from, shared_runs, sharing_source
from defshade_cli.plan import make_plan, shared_shadows
from defshade_cli.plan.plan import Plan
from defshade_cli.scene.light import DomeLight
from defshade_cli.settings import RenderSettings

ACCURACY = Path(__file__).parents[1] / "accuracy"


def sky() -> DomeLight:
    return DomeLight(path="/dome", world_from_light=np.eye(4), color=(1, 1, 1))


def planned(*, samples: int = 1, size: tuple[int, int] = (1280, 720), layers: tuple[str, ...] = ("beauty",)) -> Plan:
    of = scene([quad(9.0), sphere(1.0)], [sun(), sky()])
    return make_plan(of, RenderSettings(size=size, samples=samples, layers=layers))


def pictures(
    name: str, monkeypatch: pytest.MonkeyPatch, **options: object
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The beauty by shared look-ups, and by each pixel's own."""
    found = []
    for worthwhile in (0, 10**9):
        monkeypatch.setattr(shared_shadows, "_WORTHWHILE", worthwhile)
        found.append(render(ACCURACY / f"{name}.usda", size=(240, 135), **options).layers["beauty"][..., :3])  # type: ignore[arg-type]
    return found[0], found[1]


@pytest.mark.parametrize(("name", "samples"), [("dome_even", 1), ("dome_sun", 1), ("dome_sun", 2)])
def test_pictures_differ_where_shadows_end_alone(name: str, samples: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Edges are off by two pixels of 240; most of relMSE is at the sharpest."""
    shared, own = pictures(name, monkeypatch, samples=samples)
    error = ((shared - own) ** 2 / (own**2 + 1e-2)).mean()
    assert 0.0 < error < 2.5e-3
    np.testing.assert_allclose(shared.mean(), own.mean(), rtol=5e-3)
    same = np.abs(shared - own) <= 0.05 * own + 1e-3
    assert same.mean() > 0.9


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_without_a_shadow_nothing_differs(projection: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What reaches a pixel as a whole is 15 of 15 parts; floats are added in another order, 128 of 6e-8."""
    stage = tmp_path / "floor.usda"
    stage.write_text(f"""#usda 1.0
def Camera "Camera" {{
    token projection = "{projection}"
    float2 clippingRange = (1, 100)
    double3 xformOp:translate = (0, 5, 0)
    float3 xformOp:rotateXYZ = (-75, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
}}
def Mesh "Floor" {{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9)]
    uniform token subdivisionScheme = "none"
}}
def DomeLight "Sky" {{}}
""")
    found = []
    for worthwhile in (0, 10**9):
        monkeypatch.setattr(shared_shadows, "_WORTHWHILE", worthwhile)
        found.append(render(stage, size=(64, 36)).layers["beauty"])
    assert found[0][..., 3].mean() > 0.5
    np.testing.assert_allclose(*found, rtol=2e-5, atol=1e-6)


def test_layers_of_the_light_are_sums_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_shadows, "_WORTHWHILE", 0)
    names = ("beauty", "diffuse", "specular")
    layers = render(ACCURACY / "dome_even.usda", size=(64, 36), layers=names).layers
    covered = layers["diffuse"][..., :3].sum(axis=-1) > 0.0
    both = layers["diffuse"][..., :3] + layers["specular"][..., :3]
    np.testing.assert_allclose(both[covered], layers["beauty"][..., :3][covered], rtol=1e-4, atol=1e-5)


def test_pixels_share_many_directions_of_large_images() -> None:
    assert planned().sharing_pixels == 8
    assert planned(samples=4).sharing_pixels == 2
    assert planned(samples=16).sharing_pixels == 1
    assert planned(size=(320, 180)).sharing_pixels == 1
    assert planned(layers=("beauty", "lightComplexity")).sharing_pixels == 1


def test_runs_hold_the_dome_alone() -> None:
    plan = planned()
    dome, other = plan.domes[0], next(p for p in plan.lights if p not in plan.domes)
    lights = [other, *[dome] * 40, other]
    runs = shared_runs(lights, plan)
    assert [(run.start, run.stop) for run in runs] == [(1, 17), (17, 33), (33, 41)]
    np.testing.assert_array_equal(apart_from(len(lights), runs), [0, 41])


@pytest.mark.parametrize("classes", [2, 4, 8])
def test_each_class_is_near_each_pixel(classes: int) -> None:
    """In a run of pixels in a row each has its turn, and the nearest of any lies within two pixels across and down."""
    text = sharing_source(classes)["generated/shared_shadows.glsl"]
    steps = np.array(eval(text.split("(", 1)[1].rsplit(")", 1)[0].replace("ivec2", "")))
    of_class = (steps @ [1, 3]) % classes
    np.testing.assert_array_equal(of_class, np.repeat(np.arange(classes), len(steps) // classes))
    assert (np.abs(steps[:: len(steps) // classes]).max(axis=1) <= 2).all()
    assert all(sorted((x + 3 * y) % classes for x in range(classes)) == list(range(classes)) for y in range(4))
    assert {tuple(step) for step in steps} <= set(product(range(-6, 7), repeat=2))
