"""Opacity: what a surface shows, and what it lets through, in both of UsdPreviewSurface's modes."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from build import at, bulb, camera, drawable, quad, rotated, scene, sphere, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.measure import furnace
from defshade_cli.measure.brdf import coverage, evaluate_brdf
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import Plan, make_plan
from defshade_cli.scene.light import Light
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings

GLASS = Material("/glass", diffuse_color=(0.2, 0.4, 0.6), opacity=0.25, roughness=0.3)
FLOOR = Material("/floor", diffuse_color=(0.8, 0.3, 0.1), roughness=1.0, use_specular_workflow=True)
SLANT = replace(sun(2.0), world_from_light=rotated("y", 35.0))
SIZE = (24, 24)
SAMPLES = 64


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def pane_over_floor(glass: Material) -> Scene:
    """Seen from straight above; the pane covers all that is seen."""
    meshes = [quad(4.0), quad(4.0, 1.0)]
    placed = [drawable(meshes[0]), drawable(meshes[1], 1, 1)]
    seen = camera(5.0, 0.5, projection="orthographic")
    return scene(meshes, [SLANT], [FLOOR, glass], seen, placed)


def drawn(pipeline: Pipeline, of: Scene, **settings: object) -> NDArray[np.float32]:
    """The beauty's (R, G, B, A)."""
    chosen = RenderSettings(size=SIZE, **{"samples": SAMPLES, "shadows": False} | settings)  # type: ignore[arg-type]
    return pipeline.render(of, make_plan(of, chosen)).layers["beauty"]


def reflected(base: tuple[float, float, float], roughness: float, f0: float) -> tuple[NDArray, NDArray]:
    """(3,) of the diffuse and of the lobe, of a surface seen along its normal by the light of SLANT."""
    point = replace(furnace.dielectric(0.0, roughness, f0), base=np.array([base]))
    towards = -SLANT.axis[None]
    parts = [evaluate_brdf(point, towards, which, shading="preview-surface") for which in ((1.0, 0.0), (0.0, 1.0))]
    return tuple(SLANT.irradiance * part[0] for part in parts)  # type: ignore[return-value]


def passes(cosine: float) -> float:
    """Of the light along a direction, what goes through GLASS."""
    point = furnace.dielectric(0.0, GLASS.roughness)
    return 1.0 - float(coverage(point, GLASS.opacity, np.array([cosine]))[0])


@pytest.mark.parametrize("shadows", [False, True])
def test_transparent_glass_keeps_its_lobe_and_shows_the_floor(pipeline: Pipeline, shadows: bool) -> None:
    """opacity · diffuse + lobe + what passes · floor, itself lit by what passes towards it.

    Coins are stratified, so that the share of those that fall is off by 1e-3 over all pixels; those of the
    shadow are a texel's, and their share of 9216 off by 1 %, two deviations.
    """
    diffuse, lobe = reflected(GLASS.diffuse_color, 0.3, 0.04)
    floor = sum(reflected(FLOOR.diffuse_color, 1.0, 0.0)) * (passes(float(-SLANT.axis[2])) if shadows else 1.0)
    expected = GLASS.opacity * diffuse + lobe + passes(1.0) * floor
    settings = {"shadows": True, "samples": 16} if shadows else {}
    shown = drawn(pipeline, pane_over_floor(GLASS), **settings)[..., :3].mean(axis=(0, 1))
    np.testing.assert_allclose(shown, expected, rtol=0.01)


def test_presence_scales_everything(pipeline: Pipeline) -> None:
    ghost = replace(GLASS, opacity_mode="presence")
    own, floor = (sum(reflected(*what)) for what in ((GLASS.diffuse_color, 0.3, 0.04), (FLOOR.diffuse_color, 1.0, 0.0)))
    shown = drawn(pipeline, pane_over_floor(ghost))[..., :3].mean(axis=(0, 1))
    np.testing.assert_allclose(shown, 0.25 * own + 0.75 * floor, rtol=0.01)


@pytest.mark.parametrize("opacity", [0.0, 0.3, 0.9])
def test_alpha_is_the_coverage_in_every_pixel(pipeline: Pipeline, opacity: float) -> None:
    """Coins are stratified: among 64, the fallen ones miss their share by one at most.

    Each triangle has its own, of which the pixels along the pane's diagonal see two: 3 in 24.
    """
    alone = scene([quad(4.0)], [SLANT], [replace(GLASS, opacity=opacity)], camera(5.0, 0.5, projection="orthographic"))
    expected = coverage(furnace.dielectric(0.0, GLASS.roughness), opacity, np.array([1.0]))
    alpha = drawn(pipeline, alone)[..., 3]
    assert np.quantile(np.abs(alpha - expected), 1.0 - 3 / 24) <= 1.0 / SAMPLES + 1e-6
    assert alpha.mean() == pytest.approx(float(expected[0]), abs=2e-3)


def test_a_closed_surface_is_seen_through_itself(pipeline: Pipeline) -> None:
    """Two layers of 0.5 hide 0.75: front and back do not share a coin."""
    ball = replace(GLASS, opacity=0.5, opacity_mode="presence")
    shown = drawn(pipeline, scene([sphere(2.0, 8)], [SLANT], [ball], camera(5.0, 0.1, projection="orthographic")))
    assert shown[..., 3].mean() == pytest.approx(0.75, abs=0.01)


def test_glowing_glass_glows_whatever_its_opacity(pipeline: Pipeline) -> None:
    lamp = replace(GLASS, opacity=0.2, emissive_color=(3.0, 2.0, 1.0))
    dark = scene([quad(4.0)], [], [lamp], camera(5.0, 0.5, projection="orthographic"))
    np.testing.assert_allclose(drawn(pipeline, dark)[..., :3].mean(axis=(0, 1)), (3, 2, 1), rtol=0.01)


@pytest.mark.parametrize("low", [0.02, 0.1, 0.4])
@pytest.mark.parametrize("light", [sun(), SLANT, bulb(0.1, 0.0, 2.0)])
def test_films_let_the_product_of_what_each_does_through(pipeline: Pipeline, light: Light, low: float) -> None:
    """Two of 0.5, however near the floor: coins have texels beside each other show different layers.

    Those of 24 x 24 pixels' texels miss their share by 1 %, two deviations. The bulb stands below a plate, so that
    its maps are a cube's.
    """
    film = Material("/film", opacity=0.5, opacity_mode="presence", use_specular_workflow=True, roughness=1.0)
    film = replace(film, diffuse_color=(0.0, 0.0, 0.0))
    meshes = [quad(4.0), quad(3.0, low), quad(3.0, 0.5), quad(0.1, 2.5)]
    placed = [drawable(mesh, i, i in (1, 2)) for i, mesh in enumerate(meshes)]
    placed[3] = drawable(meshes[3], 3, 0, [at(0.6, 0.6, 0.0)])
    of = scene(meshes, [light], [FLOOR, film], camera(5.0, 0.3), placed)
    lit, shadowed = (drawn(pipeline, of, shadows=shadows)[4:20, 4:18, 0].mean() for shadows in (False, True))
    assert shadowed / lit == pytest.approx(0.25, abs=0.008)


def test_only_coins_need_the_receivers_triangles() -> None:
    """A cut is whole, and its shadow too."""
    film = replace(GLASS, opacity_mode="presence")
    names = [[p.name for p in plan_of(m).planes] for m in (film, replace(film, opacity_threshold=0.1), FLOOR)]
    assert ["triangle" in some for some in names] == [True, False, False]
    assert "triangle" not in [plane.name for plane in plan_of(film, shadows=False).planes]


def plan_of(material: Material, **settings: object) -> Plan:
    return make_plan(pane_over_floor(material), RenderSettings(**settings))  # type: ignore[arg-type]


def test_only_transparent_materials_pay() -> None:
    weights = "weights"
    assert weights in [plane.name for plane in plan_of(GLASS).planes]
    for other in (replace(GLASS, opacity=1.0), replace(GLASS, opacity_mode="presence")):
        plan = plan_of(other)
        assert not plan.transparent and weights not in [plane.name for plane in plan.planes]
    cut = plan_of(replace(GLASS, opacity_threshold=0.1))
    assert cut.cutout and not cut.transparent
    assert not plan_of(GLASS, shading="classic").transparent
    assert weights not in [plane.name for plane in plan_of(GLASS, layers=("alpha",)).planes]


@given(opacity=st.floats(0, 1), roughness=st.floats(0.1, 1), f0=st.floats(0, 1), cosine=st.floats(0.05, 1))
def test_glass_makes_no_light(opacity: float, roughness: float, f0: float, cosine: float) -> None:
    """In a white furnace: what is reflected and what passes are 1 at most, but for the quadrature's error."""
    point = furnace.dielectric(1.0, roughness, f0)
    point = replace(point, weights=np.array([[opacity, 1.0]]))

    def reflect(surface: furnace.Surface, directions: NDArray) -> NDArray:
        return evaluate_brdf(surface, directions, shading="preview-surface")

    albedo = furnace.directional_albedo(reflect, point, cosine, points=2000)
    passed = 1.0 - coverage(point, opacity, np.array([cosine]))
    assert (albedo + passed).max() <= 1.0 + 5e-3


def test_panes_converge_to_path_traced_light(pipeline: Pipeline) -> None:
    """A coated pane between a lamp, the eye and the floor; Mitsuba's null interactions carry the same transmittance.

    The lobe of a sample that was kept weighs 1 / coverage: 64 samples leave 3 % of noise in a block, and half of
    that in the mean, as those of 256 and of 512 leave 1 %.
    """
    pytest.importorskip("mitsuba")
    from defshade_cli.measure.pathtraced import path_traced

    glass = replace(GLASS, metallic=0.5, clearcoat=0.7, clearcoat_roughness=0.4)
    meshes = [quad(4.0), quad(1.0, 1.0)]
    placed = [drawable(meshes[0]), drawable(meshes[1], 1, 1)]
    of = scene(meshes, [replace(bulb(1.5, 0, 3), radius=0.3)], [FLOOR, glass], camera(5.0, 0.4), placed)
    settings = RenderSettings(size=SIZE, samples=64)
    plan = make_plan(of, settings)
    ours, theirs = pipeline.render(of, plan).layers["beauty"][..., :3], path_traced(of, plan, 128).radiance
    blocks = [image.reshape(3, 8, 3, 8, 3).mean(axis=(1, 3)) for image in (ours, theirs)]
    np.testing.assert_allclose(*blocks, rtol=0.03)
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), theirs.mean(axis=(0, 1)), rtol=0.03)


@pytest.mark.parametrize("shadows", [False, True])
def test_what_is_solid_is_drawn_apart_from_what_is_thin(pipeline: Pipeline, shadows: bool) -> None:
    """Only thin materials pay for coins of opacity; the image is the one in which all of them pay."""
    of = pane_over_floor(GLASS)
    plan = make_plan(of, RenderSettings(size=SIZE, samples=2, shadows=shadows))
    all_thin = replace(plan, thin=(0, 1))
    assert plan.thin == (1,)
    apart, together = (pipeline.render(of, way).layers["beauty"] for way in (plan, all_thin))
    np.testing.assert_array_equal(apart, together)
