"""Accumulated samples against Mitsuba 3, and what light must obey whatever the samples are."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from build import at, beauty, bulb, camera, quad, rotated, scene, sphere, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.light import DiskLight, DistantLight, Light, RectLight, SphereLight
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings

STAGES = Path(__file__).resolve().parent.parent / "accuracy"
SETTINGS = RenderSettings(size=(64, 36), samples=16)
COMMON = {"path": "/l", "color": (1, 0.5, 0.25), "intensity": 3.0}
LIGHTS: list[Light] = [
    SphereLight(**COMMON, world_from_light=at(1.0, 0.5, 2.0), radius=0.5),
    RectLight(**COMMON, world_from_light=at(-1.0, 0.0, 2.0), width=1.0, height=0.5),
    DistantLight(**COMMON, world_from_light=rotated("y", 30.0), angle=10.0),
]


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def render(pipeline: Pipeline, of: Scene) -> NDArray[np.float64]:
    return beauty(pipeline.render(of, make_plan(of, SETTINGS)).layers)


def lit_by(*lights: Light) -> Scene:
    """A ball before a wall."""
    return scene([quad(3.0, -1.0), sphere(0.7)], lights)


@pytest.mark.parametrize("stage", ["rect_small", "cone_focus"])
def test_samples_converge_to_path_traced_light(pipeline: Pipeline, stage: str) -> None:
    """64 samples at 64x36; the reference's own noise stays below a third of the bound."""
    pytest.importorskip("mitsuba")
    from defshade_cli.image.compare import compare
    from defshade_cli.measure.accuracy import reference_noise
    from defshade_cli.measure.layouts import first_frame
    from defshade_cli.measure.pathtraced import path_traced

    of = first_frame(STAGES / f"{stage}.usda")
    plan = make_plan(of, replace(SETTINGS, samples=64))
    reference = path_traced(of, plan, 256)
    image = pipeline.render(of, plan).layers["beauty"][..., :3]
    assert reference_noise(reference) < 1e-3
    assert compare(image, reference.radiance, flip=False)[0].rel_mse < 3e-3


@pytest.mark.parametrize("light", LIGHTS)
def test_twice_the_intensity_is_twice_the_image(pipeline: Pipeline, light: Light) -> None:
    once, twice = (render(pipeline, lit_by(replace(light, intensity=i))) for i in (1.0, 2.0))
    np.testing.assert_allclose(twice, 2.0 * once, rtol=1e-5, atol=1e-7)


def test_lights_together_are_the_sum_of_each_alone(pipeline: Pipeline) -> None:
    """In expectation sample by sample: each light's place follows from its number, which others keep by being black."""
    dark = [replace(light, intensity=1e-30) for light in LIGHTS]
    alone = sum(render(pipeline, lit_by(*dark[:i], LIGHTS[i], *dark[i + 1 :])) for i in range(len(LIGHTS)))
    np.testing.assert_allclose(render(pipeline, lit_by(*LIGHTS)), alone, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("scale", [0.01, 3.0])
def test_normalize_keeps_the_power_under_any_scale(pipeline: Pipeline, scale: float) -> None:
    """Far away, where a light of any size is a point: E is the same."""
    disk = DiskLight(**COMMON, world_from_light=at(0, 0, 50.0), radius=0.2, normalize=True)
    scaled = replace(disk, world_from_light=at(0, 0, 50.0) @ np.diag([scale, scale, scale, 1.0]))
    wall = scene([quad(3.0)], [disk], view=camera())
    np.testing.assert_allclose(render(pipeline, replace(wall, lights=(scaled,))), render(pipeline, wall), rtol=2e-3)


@pytest.mark.parametrize("light", [*LIGHTS, bulb(1.0, 0.5, 2.0), sun()])
def test_moving_everything_moves_nothing(pipeline: Pipeline, light: Light) -> None:
    """A rigid motion of geometry, light and camera, by what float32 and the maps' grids round: edges apart."""
    motion = rotated("x", 25.0) @ rotated("z", 70.0) @ at(7.0, -3.0, 2.0)
    of = lit_by(light)
    moved = replace(
        of,
        drawables=tuple(replace(d, world_from_object=motion @ d.world_from_object) for d in of.drawables),
        lights=tuple(replace(x, world_from_light=motion @ x.world_from_light) for x in of.lights),
        camera=replace(of.camera, world_from_camera=motion @ of.camera.world_from_camera),
    )
    still, after = render(pipeline, of), render(pipeline, moved)
    assert np.median(np.abs(after - still)) < 1e-5
    assert np.abs(after - still).mean() < 0.01 * still.mean()
