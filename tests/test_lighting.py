"""Light volumes: nothing that a light reaches is missed, wherever the camera stands."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from build import GREY, at, beauty, bulb, camera, drawable, quad, rotated, scene, sphere, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.measure import furnace
from defshade_cli.measure.brdf import evaluate_brdf
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan, volume_of
from defshade_cli.scene.light import CylinderLight, DiskLight, RectLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import LAYOUTS, Layout, RenderSettings
from defshade_cli.spaces import normalize

WHITE = Material("/white", diffuse_color=(1, 1, 1), roughness=1.0, ior=1.0)
"""ior 1 mirrors nothing but at grazing angles: Lambertian but for `white_wall`."""


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def render(pipeline: Pipeline, of: Scene, layout: Layout = "float", **options: object) -> NDArray[np.float64]:
    """(64, 64, 3) beauty without shadows."""
    settings = RenderSettings(size=(64, 64), layout=layout, shadows=False, light_points=1, **options)  # type: ignore[arg-type]
    return beauty(pipeline.render(of, make_plan(of, settings)).layers)


def wall_irradiance(z: float) -> NDArray[np.float64]:
    """E / I of a lamp at (0, 0, z) on the plane z = 0 at the pixels of the default camera."""
    x = 2.5 * ((np.arange(64) + 0.5) / 32 - 1)
    d2 = x[None, :] ** 2 + x[:, None] ** 2 + z**2
    return z / d2**1.5


def white_wall(lamp: Sequence[float], eye: float = 5.0) -> NDArray[np.float64]:
    """(64, 64) π f of WHITE on the plane z = 0 for a lamp there and an eye at (0, 0, eye), by the float64 model."""
    x = 2.5 * ((np.arange(64) + 0.5) / 32 - 1)
    points = np.stack([*np.meshgrid(x, -x), np.zeros((64, 64))], axis=-1).reshape(-1, 3)
    to_lamp = normalize(np.asarray(lamp) - points)
    surface = replace(
        furnace.seen_from(furnace.dielectric(1.0, WHITE.roughness, f0=0.0), np.array([0.0, 0.0, 1.0]), len(points)),
        view=normalize(np.array([0.0, 0.0, eye]) - points),
    )
    reflected = evaluate_brdf(surface, to_lamp, shading="preview-surface")[:, 0] / to_lamp[:, 2]
    return np.pi * reflected.reshape(64, 64)


def test_a_white_wall_in_the_sun_reads_nearly_one(pipeline: Pipeline) -> None:
    image = render(pipeline, scene([quad(5.0)], [sun()], [WHITE]))[..., 0]
    np.testing.assert_allclose(image, white_wall((0, 0, 1e9)), rtol=1e-5)
    assert image.min() > 0.99


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_point_light_falls_off_by_the_square(pipeline: Pipeline, layout: Layout) -> None:
    lamp = bulb(0, 0, 1.0)
    expected = lamp.intensity_on_axis[0] / math.pi * wall_irradiance(1.0) * white_wall(lamp.position)
    # rgba8: (0, 0, 1) is stored half a step, 1/255, off in x and y; seen at up to 74.2° that is tan(74.2°) √2/255,
    # and what WHITE mirrors changes by 0.0003 with it.
    tolerance = 0.0200 if layout == "rgba8" else 2e-5
    image = render(pipeline, scene([quad(5.0)], [lamp], [WHITE]), layout)
    np.testing.assert_allclose(image, np.repeat(expected[..., None], 3, axis=2), rtol=tolerance)


@pytest.mark.parametrize("z", [0.01, 1.0, 4.9, 4.95, 5.0, 5.05, 5.2, 9.0])
@pytest.mark.parametrize("cone", [None, 20.0, 60.0, 89.0, 90.0, 120.0, 180.0])
def test_no_pixel_is_missed_around_the_near_plane(pipeline: Pipeline, z: float, cone: float | None) -> None:
    """The eye is at z = 5, the near plane at 4.9: the lamp in front, on, between and behind them."""
    lamp = bulb(0, 0, z, cone=cone)
    angle = np.arccos(np.cbrt(wall_irradiance(z) * z * z))  # cos θ = z / d, and E / I = z / d³
    lit = np.ones((64, 64), bool) if cone is None else angle <= math.radians(cone)
    white = lamp.intensity_on_axis[0] / math.pi * wall_irradiance(z) * white_wall(lamp.position)
    expected = np.where(lit, white, 0.0)
    image = render(pipeline, scene([quad(5.0)], [lamp], [WHITE]))[..., 0]
    certain = np.abs(angle - math.radians(cone or 360.0)) > 1e-4  # float32 may round the edge's own pixels either way
    np.testing.assert_allclose(image[certain], expected[certain], rtol=1e-4, atol=1e-9)


def test_a_soft_cone_is_a_smoothstep_in_the_angle(pipeline: Pipeline) -> None:
    lamp = bulb(0, 0, 2.0, cone=40.0, softness=0.5)
    angle = np.degrees(np.arccos(np.cbrt(wall_irradiance(2.0) * 4.0)))
    t = np.clip((angle - 20.0) / 20.0, 0, 1)
    expected = lamp.intensity_on_axis[0] / math.pi * wall_irradiance(2.0) * white_wall(lamp.position)
    expected *= 1 - t * t * (3 - 2 * t)
    image = render(pipeline, scene([quad(5.0)], [lamp], [WHITE]))[..., 0]
    np.testing.assert_allclose(image, expected, rtol=1e-3, atol=expected.max() * 1e-6)


def test_the_focus_is_a_power_of_the_cosine_and_tints_the_rest(pipeline: Pipeline) -> None:
    plain = bulb(0, 0, 2.0, cone=180.0)
    assert plain.shaping
    shaped = replace(plain, shaping=replace(plain.shaping, focus=4.0, focus_tint=(1.0, 0.5, 0.0)))
    before = render(pipeline, scene([quad(5.0)], [plain], [WHITE]))
    after = render(pipeline, scene([quad(5.0)], [shaped], [WHITE]))
    focus = np.cbrt(wall_irradiance(2.0) * 4.0) ** 4
    np.testing.assert_allclose(after[..., 0], before[..., 0], rtol=1e-5)
    np.testing.assert_allclose(after[..., 1], before[..., 1] * (0.5 + 0.5 * focus), rtol=1e-4)
    np.testing.assert_allclose(after[..., 2], before[..., 2] * focus, rtol=1e-4)


def test_flat_lights_emit_one_side_by_the_cosine(pipeline: Pipeline) -> None:
    for light_type in (DiskLight, RectLight):
        lamp = light_type(path="/lamp", world_from_light=at(0, 0, 2.0), color=(1, 1, 1), intensity=3.0)
        cosine = np.cbrt(wall_irradiance(2.0) * 4.0)
        expected = 3.0 * lamp.size_factor / math.pi * wall_irradiance(2.0) * cosine * white_wall(lamp.position)
        np.testing.assert_allclose(render(pipeline, scene([quad(5.0)], [lamp], [WHITE]))[..., 0], expected, rtol=1e-4)
        away = replace(lamp, world_from_light=at(0, 0, 2.0) @ rotated("x", 180.0))
        assert render(pipeline, scene([quad(5.0)], [away], [WHITE])).max() == 0.0


def test_a_cylinder_emits_by_the_sine_off_its_length(pipeline: Pipeline) -> None:
    lamp = CylinderLight(path="/tube", world_from_light=at(0, 0, 2.0), color=(1, 1, 1), intensity=3.0, length=2.0)
    x = 2.5 * ((np.arange(64) + 0.5) / 32 - 1)
    d2 = x[None, :] ** 2 + x[:, None] ** 2 + 4.0
    expected = lamp.intensity_on_axis[0] / math.pi * wall_irradiance(2.0) * np.sqrt(1 - x[None, :] ** 2 / d2)
    expected *= white_wall(lamp.position)
    np.testing.assert_allclose(render(pipeline, scene([quad(5.0)], [lamp], [WHITE]))[..., 0], expected, rtol=1e-4)


def test_the_sum_of_lights_is_the_sum_of_images(pipeline: Pipeline) -> None:
    lights = [sun(0.5), bulb(1, 1, 2), bulb(-1, 0, 1.5, cone=35.0, softness=0.3), bulb(0, -1, 3, cone=150.0)]
    together = render(pipeline, scene([sphere()], lights, [replace(GREY, roughness=0.3)]))
    apart = sum(render(pipeline, scene([sphere()], [light], [replace(GREY, roughness=0.3)])) for light in lights)
    # Each light's reach follows from its share of the tolerance, 1e-5 in all; the rest is float32.
    np.testing.assert_allclose(together, apart, rtol=1e-5, atol=2e-5)


def test_doubled_intensity_doubles_the_image(pipeline: Pipeline) -> None:
    one = render(pipeline, scene([sphere()], [bulb(1, 1, 2)]))
    two = render(pipeline, scene([sphere()], [bulb(1, 1, 2, intensity=20.0)]))
    np.testing.assert_allclose(two, 2 * one, rtol=1e-6, atol=1e-12)


def test_exposure_is_in_stops(pipeline: Pipeline) -> None:
    of = scene([sphere()], [sun()], [replace(GREY, emissive_color=(0.1, 0.2, 0.3))])
    np.testing.assert_allclose(render(pipeline, of, exposure=3.0), 8 * render(pipeline, of), rtol=1e-6)


def test_multipliers_split_diffuse_and_specular(pipeline: Pipeline) -> None:
    """With the diffuse off, a black dielectric and a grey one look alike; both halves add up."""
    both, diffuse, specular = (
        render(pipeline, scene([sphere()], [replace(sun(), diffuse=d, specular=s)]))
        for d, s in ((1, 1), (1, 0), (0, 1))
    )
    np.testing.assert_allclose(diffuse + specular, both, rtol=1e-5, atol=1e-7)
    black = scene([sphere()], [sun()], [replace(GREY, diffuse_color=(0, 0, 0))])
    np.testing.assert_allclose(specular, render(pipeline, black), rtol=1e-5, atol=1e-7)


def test_emission_adds_to_the_light_and_coverage_is_the_alpha(pipeline: Pipeline) -> None:
    glowing = replace(WHITE, emissive_color=(2.0, 0.0, 0.5))
    of = scene([quad(1.0)], [sun()], [glowing])
    rgba = pipeline.render(of, make_plan(of, RenderSettings(size=(64, 64)))).layers["beauty"]
    np.testing.assert_allclose(rgba[32, 32], [3.0, 1.0, 1.5, 1.0], rtol=1e-5)
    np.testing.assert_array_equal(rgba[0, 0], 0.0)


def test_an_orthographic_view_sees_the_same_wall(pipeline: Pipeline) -> None:
    view = replace(camera(10.0, projection="orthographic"), window=(-2.5, 2.5, -2.5, 2.5))
    lamp = bulb(0, 0, 1.0)
    image = render(pipeline, scene([quad(5.0)], [lamp], [WHITE], view))[..., 0]
    expected = lamp.intensity_on_axis[0] / math.pi * wall_irradiance(1.0) * white_wall(lamp.position, eye=1e9)
    np.testing.assert_allclose(image, expected, rtol=2e-5)


def test_volumes_follow_the_kind_of_light() -> None:
    assert volume_of(sun()) == "quad"
    assert volume_of(bulb(0, 0, 0)) == "sphere"
    assert volume_of(bulb(0, 0, 0, cone=90.0)) == "cone"
    assert volume_of(bulb(0, 0, 0, cone=90.5)) == "sphere"


def test_many_lights_are_one_draw_a_volume_and_none_is_lost(pipeline: Pipeline) -> None:
    lamps = [bulb(x, y, 0.5, intensity=0.5) for x in np.linspace(-2, 2, 16) for y in np.linspace(-2, 2, 16)]
    image = render(pipeline, scene([quad(5.0)], lamps, [WHITE]))[..., 0]
    x = 2.5 * ((np.arange(64) + 0.5) / 32 - 1)
    expected = np.zeros((64, 64))
    for lamp in lamps:
        d2 = (x[None, :] - lamp.position[0]) ** 2 + (-x[:, None] - lamp.position[1]) ** 2 + 0.25
        expected += lamp.intensity_on_axis[0] / math.pi * 0.5 / d2**1.5 * white_wall(lamp.position)
    np.testing.assert_allclose(image, expected, rtol=1e-4, atol=1e-5)


def test_what_the_reach_drops_stays_below_the_tolerance(pipeline: Pipeline) -> None:
    lamps = [bulb(x, 0, 0.3, intensity=0.0025) for x in np.linspace(-2, 2, 50)]
    of = scene([quad(5.0)], lamps, [replace(WHITE, roughness=1.0)])
    exact = render(pipeline, of, light_tolerance=1e-30)
    for tolerance in (1e-2, 1e-1):
        plan = make_plan(of, RenderSettings(light_tolerance=tolerance))
        assert plan.lights[0].reach < make_plan(of, RenderSettings(light_tolerance=1e-30)).lights[0].reach
        dropped = exact - render(pipeline, of, light_tolerance=tolerance)
        assert dropped.min() >= -1e-6 and dropped.max() <= tolerance


def test_placement_moves_with_the_mesh(pipeline: Pipeline) -> None:
    """A rigid motion of everything, camera and light included, leaves the image."""
    motion = at(3, -2, 1) @ rotated("y", 40.0) @ rotated("x", -25.0)
    before = scene([sphere()], [bulb(1, 1, 2, cone=50.0, softness=0.4), sun()])
    after = replace(
        before,
        drawables=(drawable(sphere(), where=[motion]),),
        lights=tuple(replace(light, world_from_light=motion @ light.world_from_light) for light in before.lights),
        camera=replace(before.camera, world_from_camera=motion @ before.camera.world_from_camera),
    )
    images = [render(pipeline, of) for of in (before, after)]
    same = np.isclose(images[0], images[1], rtol=1e-3, atol=1e-4).all(-1)
    assert same.mean() > 0.999  # a silhouette pixel's centre may fall on either side
