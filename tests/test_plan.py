"""The plan: what a frame needs, what it skips."""

import math
from dataclasses import replace

import numpy as np
import pytest

from build import GREY, bulb, camera, drawable, quad, scene, sphere, sun
from defshade_cli.errors import UsageError
from defshade_cli.passes.view import camera_depth, clip_from_camera
from defshade_cli.plan import make_plan
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.light import DomeLight
from defshade_cli.settings import RenderSettings
from defshade_cli.spaces import translation

SCENE = scene([sphere()], [sun(), bulb(0, 0, 2), bulb(0, 1, 2, cone=30.0)])


def choices(**options: object) -> dict[str, str]:
    plan = make_plan(SCENE, RenderSettings(**options))  # type: ignore[arg-type]
    return {decision.subject: decision.choice for decision in plan.decisions}


def test_every_plane_and_volume_is_decided_with_a_reason() -> None:
    plan = make_plan(SCENE, RenderSettings())
    subjects = {d.subject for d in plan.decisions}
    assert {"layout", "plane base", "plane emission", "quad volumes", "cone volumes", "cutout"} <= subjects
    assert all(d.reason for d in plan.decisions)


def test_lighting_is_skipped_when_no_layer_needs_it() -> None:
    assert choices(layers=("depth", "normal"))["lighting"] == "skipped"


def test_one_float_sample_serves_data_and_beauty() -> None:
    assert not make_plan(SCENE, RenderSettings(layers=("beauty", "depth"))).data_pass
    for options in ({"samples": 4}, {"layout": "rgba8"}):
        assert make_plan(SCENE, RenderSettings(layers=("beauty", "depth"), **options)).data_pass  # type: ignore[arg-type]


def test_lights_without_power_are_dropped() -> None:
    dark = replace(SCENE, lights=(*SCENE.lights, bulb(0, 0, 2, intensity=0.0)))
    assert len(make_plan(dark, RenderSettings()).lights) == 3


def test_no_light_reaches_further_than_the_geometry() -> None:
    plan = make_plan(scene([sphere()], [bulb(0, 0, 3, intensity=1e9)]), RenderSettings())
    assert plan.lights[0].reach == pytest.approx(math.sqrt(1 + 1 + 16), rel=2e-3)


def test_a_narrow_coat_carries_a_light_further_than_the_rough_surface_below_it() -> None:
    def reach(**options: object) -> float:
        rough = replace(GREY, roughness=1.0, **options)  # type: ignore[arg-type]
        wide = scene([quad(half=1e4)], [bulb(0, 0, 3)], [rough])
        return make_plan(wide, RenderSettings(light_tolerance=1e-3)).lights[0].reach

    assert reach() == reach(clearcoat_roughness=0.1)
    assert reach(clearcoat=1.0, clearcoat_roughness=1.0) == pytest.approx(reach() * math.sqrt(4 / 3))
    assert reach(clearcoat=1.0, clearcoat_roughness=0.5) == pytest.approx(reach() * math.sqrt(67 / 3))
    assert reach(clearcoat=1.0) > 1e4


def test_the_clipping_range_is_tightened_to_the_geometry_and_never_widened() -> None:
    plan = make_plan(SCENE, RenderSettings())
    assert plan.clip == pytest.approx((4.0, 6.0), rel=2e-3)
    narrow = replace(SCENE, camera=replace(SCENE.camera, clipping_range=(4.5, 5.5)))
    assert make_plan(narrow, RenderSettings()).clip == (4.5, 5.5)


def test_unknown_layers_are_named() -> None:
    with pytest.raises(UsageError, match="no layer named shininess; there are beauty, "):
        make_plan(SCENE, RenderSettings(layers=("beauty", "shininess")))


def test_size_follows_the_settings_then_the_stage_then_the_default() -> None:
    staged = replace(SCENE, resolution=(320, 200))
    assert make_plan(staged, RenderSettings(size=(10, 20))).size == (10, 20)
    assert make_plan(staged, RenderSettings()).size == (320, 200)
    assert make_plan(SCENE, RenderSettings()).size == (1920, 1080)
    wide = replace(staged, camera=replace(SCENE.camera, window=(-1.0, 1.0, -0.5, 0.5)))
    assert make_plan(wide, RenderSettings(width=100)).size == (100, 50)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("standard", [True, False])
def test_stored_depth_gives_the_camera_depth_back(projection: str, standard: bool) -> None:
    view = replace(camera(), projection=projection)  # type: ignore[arg-type]
    clip = (0.1, 1e6)
    z = np.geomspace(0.1, 9e5, 50)
    points = np.column_stack([np.zeros(50), np.zeros(50), -z, np.ones(50)])
    x = points @ clip_from_camera(view, view.window, clip, standard).T
    stored = x[:, 2] / x[:, 3]
    assert ((stored >= -1e-12) & (stored <= 1)).all()
    np.testing.assert_allclose(camera_depth(view, clip, standard, stored), z, rtol=1e-6)  # 1e7 : 1 in float64


def test_an_off_centre_window_lands_on_the_image_corners() -> None:
    view = Camera("/c", translation(np.zeros(3)), (-0.2, 0.6, -0.1, 0.3))
    matrix = clip_from_camera(view, view.window, (1.0, 10.0), False)
    corners = np.array([[-0.2, -0.1, -1, 1], [0.6, 0.3, -1, 1]]) @ matrix.T
    np.testing.assert_allclose(corners[:, :2] / corners[:, 3:], [[-1, -1], [1, 1]], atol=1e-12)


def test_opacity_decides_the_cutout() -> None:
    assert choices()["cutout"] == "skipped"
    thin = replace(SCENE, materials=(replace(GREY, opacity=0.5),))
    assert make_plan(thin, RenderSettings()).cutout
    unbound = replace(GREY, uses_display_color=True, uses_display_opacity=True)
    see_through = replace(drawable(quad()), display_opacity=np.array([0.5], np.float32))
    assert make_plan(scene([quad()], [], [unbound], drawables=[see_through]), RenderSettings()).cutout


@pytest.mark.parametrize(("lights", "side"), [(1, 1024), (16, 1024), (64, 512), (256, 256), (1_000, 128)])
def test_shadow_maps_are_coarser_the_more_there_are(lights: int, side: int) -> None:
    """Each bulb sees all around by six maps; a sample draws some 64 million texels, until maps are the coarsest."""
    plan = make_plan(replace(SCENE, lights=(bulb(0, 0, 0.5),) * lights), RenderSettings())
    assert plan.shadow_resolution == side


@pytest.mark.parametrize(("opacity", "others", "side"), [(1.0, 1, 1024), (0.5, 1, 512), (1.0, 0, 512), (0.5, 0, 512)])
def test_maps_under_a_dome_are_coarser_where_each_adds_little(opacity: float, others: int, side: int) -> None:
    """And where casters may let light through, whatever else shines."""
    sky = DomeLight(path="/sky", world_from_light=np.eye(4), color=(1, 1, 1))
    under = replace(SCENE, lights=(sky, *[sun()] * others), materials=(replace(GREY, opacity=opacity),))
    plan = make_plan(under, RenderSettings())
    assert plan.maps_a_sample > 64 and plan.shadow_resolution == side


@pytest.mark.parametrize(("samples", "side"), [(1, 1024), (2, 512), (15, 512), (16, 1024)])
def test_shadow_maps_of_a_few_samples_are_coarser(samples: int, side: int) -> None:
    plan = make_plan(replace(SCENE, lights=(bulb(0, 0, 0.5),)), RenderSettings(samples=samples))
    assert plan.shadow_resolution == side
