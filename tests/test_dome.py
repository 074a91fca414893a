"""Dome lights: seen where no geometry is, lighting it from all around."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray
from pxr import Usd, UsdUtils

from build import camera, drawable, quad, rotated, scene, sphere
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.environment import sky_of
from defshade_cli.passes import sky_visibility
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.environment import Environment
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings
from defshade_cli.usd.reader import StageReader
from stages import stage_of

WHITE = Material("/white", diffuse_color=(1, 1, 1), roughness=1.0, ior=1.0)
MIRROR = Material("/mirror", diffuse_color=(1, 1, 1), metallic=1.0, roughness=0.0)


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def six_colours() -> Environment:
    """Each direction shows the colour of the axis it is nearest to: ±X red, ±Y green, ±Z blue; − at half."""
    latitude = math.pi * (0.5 - (np.arange(64) + 0.5) / 64)[:, None]
    longitude = 2 * math.pi * (0.5 - (np.arange(128) + 0.5) / 128)[None, :]
    d = np.stack(
        np.broadcast_arrays(
            np.sin(longitude) * np.cos(latitude), np.sin(latitude), np.cos(longitude) * np.cos(latitude)
        ),
        axis=-1,
    )
    axis = np.abs(d).argmax(-1)
    sign = np.take_along_axis(d, axis[..., None], -1)[..., 0] > 0
    return Environment(np.eye(3)[axis] * np.where(sign, 1.0, 0.5)[..., None])


def dome(**options: object) -> DomeLight:
    options = {"path": "/dome", "world_from_light": np.eye(4), "color": (1, 1, 1)} | options
    return DomeLight(**options)  # type: ignore[arg-type]


def render(pipeline: Pipeline, of: Scene, **options: object) -> NDArray[np.float32]:
    """(32, 32, 4)"""
    plan = make_plan(of, RenderSettings(size=(32, 32), **options))  # type: ignore[arg-type]
    return pipeline.render(of, plan).layers["beauty"]


@pytest.mark.parametrize("samples", [1, 16])
def test_a_white_wall_under_a_white_dome_is_white(pipeline: Pipeline, samples: int) -> None:
    """E = π L. Sixteen samples are 64 directions, half of them behind the wall: 5 % is what is left of chance."""
    image = render(pipeline, scene([quad(9.0)], [dome()], [WHITE]), samples=samples)
    np.testing.assert_allclose(image[..., :3].mean(), 1.0, rtol=0.05)


def test_directions_teach_the_same_however_many_a_draw(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of what a metal sees of the sky around a pane that lets some of it through; floats add up in other orders."""
    glass, metal = replace(WHITE, opacity=0.5), replace(MIRROR, roughness=0.2)
    meshes = [sphere(), quad(3.0, -1.0), quad(0.7, 1.2)]
    drawn = [drawable(mesh, number, number) for number, mesh in enumerate(meshes)]
    of = scene(meshes, [dome(environment=six_colours())], [metal, WHITE, glass], drawables=drawn)
    plan = make_plan(of, RenderSettings(size=(32, 32)))
    assert any(plan.hides_sky(planned) for planned in plan.domes)
    found = []
    for most in (1, 5, 64):
        monkeypatch.setattr(sky_visibility, "_MOST", most)
        found.append(Pipeline(gpu).render(of, plan).layers["beauty"])
    np.testing.assert_allclose(found[1:], [found[0]] * 2, rtol=1e-4, atol=1e-6)


def test_a_lid_hides_the_dome_and_needs_samples_to_do_so(pipeline: Pipeline) -> None:
    of = scene([quad(9.0), quad(9.0, 1.0)], [dome()], [WHITE], camera(0.9))
    assert render(pipeline, of, samples=16)[..., :3].mean() < 0.15
    assert render(pipeline, of, samples=16, shadows=False)[..., :3].mean() > 0.9


def test_the_background_shows_the_sky_and_covers(pipeline: Pipeline) -> None:
    for turn, colour in (
        (np.eye(4), [0, 0, 0.5]),
        (rotated("y", 180.0), [0, 0, 1.0]),
        (rotated("y", -90.0), [1.0, 0, 0]),
        (rotated("y", 90.0), [0.5, 0, 0]),
        (rotated("x", 90.0), [0, 1.0, 0]),
    ):
        view = replace(camera(0.0, 0.2), world_from_camera=turn)
        of = scene([quad(0.01, 50.0)], [dome(environment=six_colours())], [WHITE], view)
        np.testing.assert_allclose(render(pipeline, of)[16, 16], [*colour, 1.0], atol=2e-3)
        assert not render(pipeline, of, background=False)[0, 0].any()


def test_the_background_turns_with_the_dome(pipeline: Pipeline) -> None:
    turned = dome(environment=six_colours(), world_from_light=rotated("y", 90.0))  # the sky's +Z goes to +X
    view = replace(camera(0.0, 0.2), world_from_camera=rotated("y", -90.0))
    of = scene([quad(0.01, 50.0)], [turned], [WHITE], view)
    np.testing.assert_allclose(render(pipeline, of)[16, 16], [0, 0, 1.0, 1.0], atol=2e-3)


def test_a_mirror_ball_shows_the_sky_behind_the_camera(pipeline: Pipeline) -> None:
    of = scene([sphere()], [dome(environment=six_colours())], [MIRROR])
    centre = render(pipeline, of)[15:17, 15:17, :3].mean((0, 1))
    np.testing.assert_allclose(centre, [0, 0, 1.0], atol=0.02)


def test_intensity_and_exposure_scale_dome_and_background_alike(pipeline: Pipeline) -> None:
    one = render(pipeline, scene([quad(1.0)], [dome()], [WHITE]))
    four = render(pipeline, scene([quad(1.0)], [dome(intensity=2.0, exposure=1.0)], [WHITE]))
    np.testing.assert_allclose(four[..., :3], 4 * one[..., :3], rtol=1e-5)


def test_the_analytic_term_agrees_with_many_samples(pipeline: Pipeline) -> None:
    """On a rough sphere alone in a smooth sky: spherical harmonics within a few per cent of 256 directions."""
    latitude = math.pi * (0.5 - (np.arange(32) + 0.5) / 32)
    sky = Environment(np.repeat((1 + np.sin(latitude))[:, None, None], 64, axis=1) * np.ones(3))
    of = scene([sphere()], [dome(environment=sky)], [WHITE])
    one, many = render(pipeline, of, light_points=1), render(pipeline, of, samples=64)
    inner = (slice(12, 20), slice(12, 20))
    np.testing.assert_allclose(one[inner], many[inner], rtol=0.05)


def test_domes_are_read_with_their_image_and_pole(tmp_path: Path) -> None:
    image = oiio.ImageBuf(np.full((4, 8, 3), 0.25, np.float32))
    assert image.write(str(tmp_path / "sky.exr"), "float")
    text = f"""
    def Cube "Cube" {{}}
    def DomeLight "Old" {{
        asset inputs:texture:file = @{tmp_path}/sky.exr@
    }}
    def DomeLight_1 "New" {{}}
    def DomeLight "Lost" {{
        asset inputs:texture:file = @./nowhere.exr@
    }}
    """
    read = StageReader(stage_of(text, 'upAxis = "Z"')).read(None)
    lights = {light.path: light for light in read.lights}
    assert isinstance(lights["/Old"], DomeLight) and sky_of(lights["/Old"]).radiance[0, 0, 0] == 0.25
    np.testing.assert_array_equal(lights["/Old"].world_from_light, np.eye(4))
    np.testing.assert_allclose(lights["/New"].world_from_light @ [0, 1, 0, 0], [0, 0, 1, 0])
    np.testing.assert_allclose(lights["/New"].world_from_light @ [0, 0, 1, 0], [0, -1, 0, 0])
    assert any("nowhere.exr is not found" in issue.reason for issue in read.unsupported)


def test_a_sky_inside_a_package_is_the_sky_of_its_folder(tmp_path: Path) -> None:
    """As usdz packagers leave it: the image lies in the package under a path from its layer."""
    image = oiio.ImageBuf(np.full((4, 8, 3), 0.25, np.float32))
    assert image.write(str(tmp_path / "sky.exr"), "float")
    text = 'def Cube "Cube" {}\ndef DomeLight "Sky" { asset inputs:texture:file = @./sky.exr@ }'
    (tmp_path / "stage.usda").write_text(f"#usda 1.0\n{text.replace(' }', chr(10) + '}')}\n")
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "stage.usda"), str(tmp_path / "stage.usdz"))
    (tmp_path / "sky.exr").unlink()
    (sky,) = StageReader(Usd.Stage.Open(str(tmp_path / "stage.usdz"))).read(None).lights
    assert isinstance(sky, DomeLight) and np.all(sky_of(sky).radiance == 0.25)


def test_samples_hide_the_sky_from_a_mirror(pipeline: Pipeline) -> None:
    """A polished floor that sees but a lid: the analytic term shows the sky, directions learn that it is hidden."""
    of = scene([quad(9.0), quad(9.0, 1.0)], [dome()], [MIRROR], camera(0.9))
    assert render(pipeline, of, light_points=1)[..., :3].mean() > 0.9
    assert max(render(pipeline, of, samples=n)[..., :3].mean() for n in (1, 16)) < 0.05
    assert render(pipeline, of, samples=16, shadows=False)[..., :3].mean() > 0.9


@pytest.mark.parametrize("roughness", [0.1, 0.25])
def test_lobes_of_any_width_give_the_sky_back(pipeline: Pipeline, roughness: float) -> None:
    """What a lobe does not show as an image comes from directions: together they are the metal's albedo, 5 % by chance.

    The inner part of a ball, which nothing hides.
    """
    metal = Material("/metal", diffuse_color=(1, 1, 1), metallic=1.0, roughness=roughness)
    of = scene([sphere()], [dome()], [metal])
    one, many = (render(pipeline, of, samples=n)[12:20, 12:20, :3].mean() for n in (1, 64))
    np.testing.assert_allclose(many, one, rtol=0.05)


def test_samples_do_not_know_what_was_drawn_before(gpu: Gpu) -> None:
    """Not what was summed, after the small look around that a dome's directions are drawn by."""
    lit = scene([quad(9.0), sphere(1.0)], [DomeLight(path="/dome", world_from_light=np.eye(4), color=(1, 1, 1))])
    plans = [make_plan(lit, RenderSettings(size=(160, 90), samples=count)) for count in (2, 4, 4)]
    pipeline = Pipeline(gpu)
    first, second = [pipeline.render(lit, plan).layers["beauty"] for plan in plans][1:]
    alone = Pipeline(gpu).render(lit, plans[1]).layers["beauty"]
    np.testing.assert_array_equal(first, alone)
    np.testing.assert_array_equal(second, alone)
