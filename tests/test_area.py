"""A single sample under lights of some size, against the float64 integral over their surfaces."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from build import at, beauty, camera, quad, scene
from defshade_cli.gpu.context import Gpu
from defshade_cli.measure.area import area_radiance
from defshade_cli.measure.error import relative_differences
from defshade_cli.measure.layouts import first_frame
from defshade_cli.measure.reference import surface_from_planes
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.passes.sampling import owen_sobol_3d
from defshade_cli.plan import make_plan
from defshade_cli.plan.points import samples_whole, share_points, share_shown
from defshade_cli.scene.emission import Emitter, emitter_at
from defshade_cli.scene.light import CylinderLight, DiskLight, DomeLight, Light, RectLight, SphereLight
from defshade_cli.scene.mesh_light import MeshLight
from defshade_cli.settings import RenderSettings

STAGES = Path(__file__).resolve().parent.parent / "accuracy"
LARGE = ["sphere_large", "disk_large", "rect_large", "cylinder", "distant_wide", "cone_focus"]


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Iterator[Pipeline]:
    yield Pipeline(gpu)


def errors(pipeline: Pipeline, stage: str, points: int) -> NDArray[np.float64]:
    """Relative differences of lit pixels between one sample with `points` points and the integral."""
    scene = first_frame(STAGES / f"{stage}.usda")
    plan = make_plan(scene, RenderSettings(size=(48, 27), shadows=False, light_points=points, light_tolerance=1e-9))
    image = beauty(pipeline.render(scene, plan).layers)
    surface, covered = surface_from_planes(pipeline.planes(scene, plan), plan.camera)
    expected = np.zeros_like(image)
    expected[covered] = sum(area_radiance(surface, light) for light in scene.lights) * plan.camera.exposure
    return relative_differences(image, expected)


@pytest.mark.parametrize("stage", LARGE)
def test_points_converge_to_the_integral_over_the_light(pipeline: Pipeline, stage: str) -> None:
    """256 points were within 0.7 % at the median and 3.1 % at the 95th percentile, worst under the large sphere."""
    found = errors(pipeline, stage, 256)
    assert np.median(found) < 0.01 and np.percentile(found, 95) < 0.05


@pytest.mark.parametrize("stage", LARGE)
def test_a_single_sample_is_near_the_integral(pipeline: Pipeline, stage: str) -> None:
    """The median was 0.8 to 3.4 %: what 16 points leave, or four under the middling cone."""
    assert np.median(errors(pipeline, stage, 16)) < 0.05


@pytest.mark.parametrize(
    "light",
    [
        SphereLight(path="/l", world_from_light=at(0, 0, 0), color=(1, 1, 1), radius=0.5),
        DiskLight(path="/l", world_from_light=at(0, 0, 0), color=(1, 1, 1), radius=0.5),
        RectLight(path="/l", world_from_light=at(0, 0, 0), color=(1, 1, 1), width=0.6, height=0.8),
        CylinderLight(path="/l", world_from_light=at(0, 0, 0), color=(1, 1, 1), radius=0.3, length=0.8),
    ],
)
def test_spread_holds_every_point_of_a_light(light: Light) -> None:
    assert light.spread == pytest.approx(0.5)


@pytest.mark.parametrize("samples", [4, 64])
def test_a_light_that_nearly_touches_a_surface_does_not_sparkle(pipeline: Pipeline, samples: int) -> None:
    """Over a floor that shows 0.5 at most at the limit; by points alone the brightest pixels had 1314 and 84."""
    panel = RectLight(path="/l", world_from_light=at(0, 0, 1e-3), color=(1, 1, 1), width=0.2, height=0.2)
    plan = RenderSettings(size=(64, 64), shadows=False, samples=samples, light_points=1)
    world = scene([quad(0.1)], [panel], view=camera(half=0.02))
    image = beauty(pipeline.render(world, make_plan(world, plan)).layers)
    assert 0.25 < image.max() < 4 * 0.5


def _without_arguments(kind: type[Light]) -> Light:
    return kind(path="/l", world_from_light=at(0, 0, 0), color=(1, 1, 1))  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", [kind for kind in Light.__subclasses__() if kind not in (DomeLight, MeshLight)])
def test_samples_see_points_all_over_a_light(kind: type[Light]) -> None:
    """A kind without a case in scene/emission.py would be a point, its shadows sharp."""
    points = [emitter_at(_without_arguments(kind), (u, u, u), np.array([0.0, 0.0, -5.0])) for u in (0.1, 0.6)]
    assert (points[0].position != points[1].position).any() or (points[0].axis != points[1].axis).any()


def test_large_lights_share_the_points_that_few_samples_lack() -> None:
    def points(*sizes: float, samples: int = 1, of: int = 16) -> list[int]:
        return share_points(sizes, RenderSettings(samples=samples, light_points=of))

    assert points(0.5) == [16] and points(0.1) == [4] and points(0.01) == [1]
    assert points(0.5, 0.01, 0.5) == [8, 1, 8]
    assert points(0.5, samples=4) == [4] and points(0.5, samples=16) == [1] and points(0.5, samples=100) == [1]
    assert points(0.5, of=1) == [1] and points(*[0.5] * 64) == [1] * 64
    assert all(math.log2(n).is_integer() for n in points(*[0.5] * 5))


def test_discs_that_small_lights_show_as_vary_as_the_light_does() -> None:
    """All of the light from its centre in the first samples; then half of its area, at places that vary by as much."""
    ball = SphereLight(path="/l", world_from_light=at(1, 2, 3), color=(1, 1, 1), radius=0.5)

    def shown(index: int) -> Emitter:
        point = emitter_at(ball, owen_sobol_3d(index % 256, 0), np.zeros(3))
        disc = point.shown_as(ball, share_shown(index, 128)).shown
        assert disc is not None
        return disc

    assert shown(0).position.tolist() == [1, 2, 3] and shown(127).extent == pytest.approx(math.pi * 0.25)
    assert shown(255).extent == pytest.approx(0.5 * math.pi * 0.25) and share_shown(2**20, 128) < 1e-3
    aside = np.array([emitter_at(ball, owen_sobol_3d(i, 0), np.zeros(3)).shown_as(ball, 0.5) for i in range(256)])
    places = np.array([emitter.shown.position - ball.position for emitter in aside])[:, :2]
    assert np.sum(places**2) / 256 == pytest.approx(0.5 * (0.5 * 0.25), rel=0.02)


def test_small_lights_show_as_a_whole_while_points_would_err_more() -> None:
    """Those that look smaller than any lobe always; others in 20 samples for each lobe they hold."""
    ball = SphereLight(path="/l", world_from_light=at(0, 0, 0), color=(1, 1, 1), radius=0.5)

    def whole(narrowest: float, samples: int, light: Light = ball, size: float = 0.05) -> int:
        return samples_whole(light, 1, size, narrowest, RenderSettings(samples=samples))

    assert whole(0.04, 16) == whole(0.04, 4096) == 128
    assert (whole(0.0025, 1024), whole(0.0025, 4096), whole(0.01, 64), whole(0.01, 256)) == (1024, 0, 64, 0)
    assert not whole(0.04, 16, size=0.5) and not whole(
        0.04, 16, RectLight(path="/l", world_from_light=at(0, 0, 0), color=(1, 1, 1))
    )
