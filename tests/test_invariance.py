"""What holds for every type of light: linearity, the power of normalised lights, rigid motions, sums."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from build import at, beauty, camera, drawable, quad, rotated, scene, sphere
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.environment import Environment
from defshade_cli.scene.ies import parse_ies
from defshade_cli.scene.light import CylinderLight, DiskLight, DistantLight, DomeLight, Light, RectLight, SphereLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.mesh_light import MeshLight
from defshade_cli.scene.radiance_map import RadianceMap
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.shaping import Shaping
from defshade_cli.settings import RenderSettings
from defshade_cli.spaces import Matrix

GLOSSY = Material("/glossy", diffuse_color=(0.7, 0.5, 0.3), roughness=0.4)
WHITE = Material("/white", diffuse_color=(1, 1, 1), roughness=1.0, ior=1.0)
PLACE = at(0.8, 0.6, 2.2) @ rotated("x", 25.0) @ rotated("y", 15.0)
IES = "IESNA91\nTILT=NONE\n1 -1 1 4 3 1 2 0 0 0\n1 1 1\n0 30 60 180\n0 90 180\n9 5 2 1 3 7 1 1 1 4 4 1\n"


def _tetrahedron() -> NDArray[np.float64]:
    a, b, c, d = 0.4 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    return np.array([[a, b, c], [a, c, d], [a, d, b], [b, d, c]])


def _sky() -> Environment:
    rng = np.random.default_rng(8)
    return Environment(0.2 + rng.random((8, 16, 3)).astype(np.float32))


def _light(kind: type[Light], **options: object) -> Light:
    return kind(path=f"/{kind.kind}", world_from_light=PLACE, color=(1.0, 0.8, 0.6), **options)  # type: ignore[call-arg]


LIGHTS: dict[str, Light] = {
    "distant": _light(DistantLight, angle=20.0, intensity=4.0),
    "sphere": _light(SphereLight, intensity=6.0),
    "point": _light(SphereLight, intensity=6.0, treat_as_point=True),
    "disk": _light(DiskLight, intensity=8.0),
    "rect": _light(RectLight, width=1.2, height=0.6, intensity=8.0),
    "image": _light(
        RectLight, intensity=8.0, radiance_map=RadianceMap(np.random.default_rng(2).random((6, 5, 3), np.float32))
    ),
    "cylinder": _light(CylinderLight, radius=0.2, length=1.5, intensity=6.0),
    "mesh": _light(MeshLight, corners=_tetrahedron(), tints=np.ones((4, 3)), intensity=6.0),
    "cone": _light(SphereLight, intensity=9.0, shaping=Shaping(cone_angle=50.0, cone_softness=0.5, focus=1.5)),
    "profile": _light(SphereLight, intensity=2.0, shaping=Shaping(cone_angle=180.0, ies=parse_ies(IES))),
    "dome": _light(DomeLight, environment=_sky()),
}
SIZED = [name for name in LIGHTS if name not in ("point", "dome", "distant")]


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def stage(*lights: Light) -> Scene:
    """A glossy ball before a wall."""
    meshes = [quad(3.0, -0.8), sphere(0.7)]
    return scene(meshes, lights, [GLOSSY], camera(6.0))


def render(pipeline: Pipeline, of: Scene, **options: object) -> NDArray[np.float64]:
    plan = make_plan(of, RenderSettings(size=(32, 32), **options))  # type: ignore[arg-type]
    return beauty(pipeline.render(of, plan).layers)


@pytest.mark.parametrize("name", LIGHTS)
def test_twice_the_intensity_is_twice_the_image(pipeline: Pipeline, name: str) -> None:
    light = LIGHTS[name]
    one = render(pipeline, stage(light), samples=2)
    two = render(pipeline, stage(replace(light, intensity=2.0 * light.intensity)), samples=2)
    assert one.max() > 0.05
    np.testing.assert_allclose(two, 2.0 * one, rtol=2e-6, atol=2e-5)  # a brighter light reaches further


@pytest.mark.parametrize("exposure", [-1.5, 3.0])
@pytest.mark.parametrize("name", ["rect", "distant", "dome"])
def test_an_exposure_is_a_power_of_two_of_the_intensity(pipeline: Pipeline, name: str, exposure: float) -> None:
    light = LIGHTS[name]
    images = [
        render(pipeline, stage(replace(light, **change)), samples=2)
        for change in ({"exposure": exposure}, {"intensity": light.intensity * 2.0**exposure})
    ]
    np.testing.assert_allclose(images[0], images[1], rtol=1e-6)


@pytest.mark.parametrize("scale", [(0.25, 0.25, 0.25), (0.5, 0.3, 0.3)])
@pytest.mark.parametrize("name", SIZED)
def test_a_normalized_light_keeps_its_power_under_any_scale(
    pipeline: Pipeline, name: str, scale: tuple[float, float, float]
) -> None:
    """On a wall 8 units off, where half a unit of size is 0.4 % of the distance squared. Spheres and meshes that are
    stretched change their far field's shape too, not its mean: they are scaled evenly."""
    if name in ("sphere", "mesh", "cone", "profile"):
        scale = (scale[0],) * 3
    light = replace(LIGHTS[name], normalize=True, world_from_light=at(0, 0, 8.0))
    scaled = replace(light, world_from_light=at(0, 0, 8.0) @ np.diag([*scale, 1.0]))
    wall = [scene([quad(3.0)], [some], [WHITE]) for some in (light, scaled)]
    images = [render(pipeline, of, samples=24, shadows=False) for of in wall]
    assert images[0].min() > 0
    np.testing.assert_allclose(images[1].mean(), images[0].mean(), rtol=0.02)


@pytest.mark.parametrize("angle", [0.0, 0.53, 10.0, 60.0])
def test_a_normalized_sun_keeps_its_illuminance_at_any_angle(pipeline: Pipeline, angle: float) -> None:
    """On a wall that faces it: the intensity in lux, over π."""
    light = replace(LIGHTS["distant"], world_from_light=np.eye(4), normalize=True, angle=angle, color=np.ones(3))
    image = render(pipeline, scene([quad(3.0)], [light], [WHITE]), samples=24, shadows=False)
    assert image.mean() == pytest.approx(4.0 / math.pi, rel=0.01)


def test_normalize_does_not_concern_domes(pipeline: Pipeline) -> None:
    dome = LIGHTS["dome"]
    images = [render(pipeline, stage(replace(dome, normalize=n)), samples=2) for n in (False, True)]
    np.testing.assert_array_equal(images[0], images[1])


MOTION: Matrix = at(-1.0, 4.0, 2.0) @ rotated("x", -90.0) @ rotated("z", 180.0)
"""By right angles: the boxes that points on lights are aimed by stay what they are."""


def moved(of: Scene, motion: Matrix) -> Scene:
    return replace(
        of,
        drawables=tuple(replace(d, world_from_object=motion @ d.world_from_object) for d in of.drawables),
        lights=tuple(replace(light, world_from_light=motion @ light.world_from_light) for light in of.lights),
        camera=replace(of.camera, world_from_camera=motion @ of.camera.world_from_camera),
    )


@pytest.mark.parametrize("name", LIGHTS)
def test_a_rigid_motion_of_everything_leaves_the_image(pipeline: Pipeline, name: str) -> None:
    """Pixel by pixel, but for silhouettes, whose pixels' centres may fall on either side in float32."""
    of = stage(LIGHTS[name])
    images = [render(pipeline, some, samples=2, shadows=False) for some in (of, moved(of, MOTION))]
    same = np.isclose(images[0], images[1], rtol=2e-3, atol=1e-4).all(axis=-1)
    assert same.mean() > 0.99


@pytest.mark.parametrize("name", LIGHTS)
def test_shadows_move_along(pipeline: Pipeline, name: str) -> None:
    """Maps turn about their light's direction by the world's axes: single texels differ, the picture does not."""
    of = stage(LIGHTS[name])
    images = [render(pipeline, some, samples=4) for some in (of, moved(of, MOTION))]
    assert np.abs(images[0] - images[1]).mean() < 0.01 * images[0].mean()


@pytest.mark.parametrize(("shadows", "weight"), [(False, 0.0), (True, 1.0 / 4096)])
def test_lights_apart_add_up_to_lights_together(pipeline: Pipeline, shadows: bool, weight: float) -> None:
    """Exactly where lights are points, but for the edges of shadows.

    The weights of texels in an atlas of 4096 have as many steps, which fall otherwise where a map has another place.
    """
    options = {"background": False, "light_points": 1, "shadows": shadows}
    together = render(pipeline, stage(*LIGHTS.values()), **options)
    alone = [render(pipeline, stage(light), **options) for light in LIGHTS.values()]
    allowed = 1e-6 + weight * np.max(alone)
    np.testing.assert_allclose(together, sum(alone), rtol=1e-6, atol=allowed)
    edges = np.abs(together - sum(alone)) > 1e-5
    assert edges.mean() < 0.01


def test_sampled_lights_add_up_on_average(pipeline: Pipeline) -> None:
    """Each light has other points beside others than alone: 32 of each leave 1 % on the whole, and more of a dome."""
    options = {"samples": 32, "shadows": False}
    lights = [light for name, light in LIGHTS.items() if name != "dome"]
    together = render(pipeline, stage(*lights), **options)
    apart = sum(render(pipeline, stage(light), **options) for light in lights)
    np.testing.assert_allclose(together.mean(), np.mean(apart), rtol=0.01)
    assert np.abs(together - apart).mean() < 0.05 * np.mean(apart)


def test_a_light_given_twice_is_as_bright_as_one_of_twice_the_intensity(pipeline: Pipeline) -> None:
    light = LIGHTS["sphere"]
    twice = render(pipeline, stage(light, light), light_points=1)
    np.testing.assert_allclose(twice, 2.0 * render(pipeline, stage(light), light_points=1), rtol=1e-5, atol=2e-5)


def test_an_instance_is_lit_like_a_copy(pipeline: Pipeline) -> None:
    ball, places = sphere(0.5), [at(-0.8, 0, 0), at(0.8, 0, 0)]
    light = LIGHTS["rect"]
    instanced = scene([ball], [light], [GLOSSY], drawables=[drawable(ball, where=places)])
    copied = scene([ball], [light], [GLOSSY], drawables=[drawable(ball, where=[p]) for p in places])
    images = [render(pipeline, of, samples=2) for of in (instanced, copied)]
    np.testing.assert_allclose(images[0], images[1], rtol=1e-6)
