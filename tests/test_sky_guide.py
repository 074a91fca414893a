"""Directions of a sky are drawn where the image looks for light."""

from dataclasses import replace

import numpy as np
import pytest

from build import camera, quad, rotated, scene, sphere
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.passes.sampling import owen_sobol
from defshade_cli.passes.sky_guide import scout, sky_guides
from defshade_cli.plan import make_plan
from defshade_cli.scene.environment import uniform_environment
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings

MIRROR = Material("/mirror", diffuse_color=(1, 1, 1), metallic=1.0, roughness=0.05)
SKY = DomeLight(path="/sky", world_from_light=rotated("y", 70.0), color=(1, 1, 1))


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def directions(pipeline: Pipeline, of: Scene, rays: int = 0) -> np.ndarray:
    """(1024, 3) world space."""
    return drawn(pipeline, of, rays)[0]


def drawn(pipeline: Pipeline, of: Scene, rays: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """(1024, 3) world space, and the radiance over the density, (1024, 3)."""
    plan = scout(make_plan(of, RenderSettings(size=(64, 64), samples=4)))
    plan = replace(plan, lights=tuple(replace(planned, by_rays=rays > 0) for planned in plan.lights))
    density = sky_guides(pipeline.planes(of, plan), plan)[SKY]
    samples = [uniform_environment().sample(owen_sobol(i, 1), density) for i in range(1024)]
    local, radiance = (np.array([sample[k] for sample in samples]) for k in (0, 1))
    return local @ SKY.world_from_light[:3, :3].T, radiance


def test_a_mirror_looks_back_at_the_camera(pipeline: Pipeline) -> None:
    """Of 85 %, for it has no diffuse, 50 are the sky's own and 35 lie where the wall mirrors a narrow view."""
    of = scene([quad(5.0)], [SKY], [MIRROR], camera(5.0, 0.1))
    backwards = directions(pipeline, of)[:, 2] > np.cos(np.radians(25.0))
    assert backwards.mean() == pytest.approx(35 / 85 + 50 / 85 * 0.5 * (1.0 - np.cos(np.radians(25.0))), abs=0.05)


def test_a_matte_wall_looks_at_its_half_of_the_sky(pipeline: Pipeline) -> None:
    of = scene([quad(5.0)], [SKY], [replace(MIRROR, metallic=0.0)], camera(5.0, 0.1))
    assert (directions(pipeline, of)[:, 2] > 0.0).mean() > 0.7


def test_a_thousand_directions_know_the_light_on_what_is_seen(pipeline: Pipeline) -> None:
    """What a wall and a ball scatter is known by its cosines; chance in that would be chance in each direction."""
    of = scene([quad(5.0), sphere()], [SKY], [replace(MIRROR, metallic=0.0)], camera(5.0, 0.3))
    directions, radiance = drawn(pipeline, of, rays=1)
    assert (np.maximum(directions[:, 2], 0.0) * radiance[:, 1]).mean() == pytest.approx(np.pi, rel=0.003)


def test_nothing_is_looked_for_where_nothing_is_lit(pipeline: Pipeline) -> None:
    of = scene([quad(5.0)], [SKY], [MIRROR], camera(5.0, 0.1))
    film = pipeline.render(of, make_plan(of, RenderSettings(size=(8, 8), samples=2, layers=("alpha",))))
    assert (film.layers["alpha"] == 1.0).all()


def test_lobes_that_have_rays_draw_no_directions(pipeline: Pipeline) -> None:
    of = scene([quad(5.0)], [SKY], [MIRROR], camera(5.0, 0.1))
    backwards = directions(pipeline, of, rays=1)[:, 2] > np.cos(np.radians(25.0))
    assert backwards.mean() == pytest.approx(0.5 * (1.0 - np.cos(np.radians(25.0))), abs=0.02)
