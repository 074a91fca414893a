"""Shadow maps and area lights by accumulation, against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from build import at, beauty, bulb, camera, drawable, quad, rotated, scene, sphere, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.passes.sampling import owen_sobol_3d
from defshade_cli.plan import make_plan
from defshade_cli.scene.emission import emitter_at, far_field
from defshade_cli.scene.light import CylinderLight, DiskLight, DistantLight, Light, RectLight, SphereLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings

WHITE = Material("/white", diffuse_color=(1, 1, 1), roughness=1.0, ior=1.0)


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def render(pipeline: Pipeline, of: Scene, **options: object) -> NDArray[np.float64]:
    """(64, 64) red channel."""
    plan = make_plan(of, RenderSettings(size=(64, 64), light_points=1, **options))  # type: ignore[arg-type]
    return beauty(pipeline.render(of, plan).layers)[..., 0]


def pixel_grid() -> tuple[NDArray, NDArray]:
    """World x and y of the default camera's pixels on the plane z = 0."""
    x = 2.5 * ((np.arange(64) + 0.5) / 32 - 1)
    return x[None, :], -x[:, None]


def above_wall(light: Light, half: float, z: float) -> Scene:
    """A wall at z = 0 and a square of `half` at height z; the camera sees the wall past it."""
    return scene([quad(5.0), quad(half, z)], [light], [WHITE], camera(5.0))


@pytest.mark.parametrize("where", [(0.0, 0.0, 1.2), (1.5, 0.5, 2.5)])
@pytest.mark.parametrize("cone", [None, 50.0])
def test_a_point_light_casts_the_projected_square(
    pipeline: Pipeline, where: tuple[float, float, float], cone: float | None
) -> None:
    lamp = bulb(*where, cone=cone)
    lit = render(pipeline, above_wall(lamp, 0.4, 0.5), shadows=False)
    shadowed = render(pipeline, above_wall(lamp, 0.4, 0.5))
    x, y = pixel_grid()
    scale = where[2] / (where[2] - 0.5)
    centre = [w * (1 - scale) for w in where[:2]]
    inside = np.maximum(np.abs(x - centre[0]), np.abs(y - centre[1])) - 0.4 * scale
    seen = np.maximum(np.abs(x), np.abs(y)) > 0.4 * 5.0 / 4.5 + 0.1  # past the occluder, a pixel of slack
    dark, bright = seen & (inside < -0.03), seen & (inside > 0.03)
    assert dark.any()
    np.testing.assert_array_equal(shadowed[dark], 0.0)
    np.testing.assert_allclose(shadowed[bright], lit[bright], rtol=1e-6)


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("degrees", [0, 90, 180, 270, 30])
def test_each_face_of_a_cube_casts_shadows_where_they_belong(pipeline: Pipeline, axis: str, degrees: float) -> None:
    """A lamp before the camera, a square off its axis, a wall: the square projected, whichever way all is turned."""
    turn = rotated(axis, degrees)
    parts = [
        drawable(quad(4.0), 0, where=[turn @ at(0, 0, -2)]),
        drawable(quad(0.15), 1, where=[turn @ at(0.3, 0.1, -1)]),
    ]
    view = replace(camera(0.0, 0.5), world_from_camera=turn @ at(0, 0, 0.9), clipping_range=(0.01, 100.0))
    of = scene([quad(4.0), quad(0.15)], [bulb(0, 0, 0)], [WHITE], view, parts)
    x = (np.arange(64) + 0.5) / 64 - 0.5
    x, y = x[None, :], -x[:, None]  # tangents of the view
    sees_wall = np.maximum(np.abs(1.9 * x - 0.3), np.abs(1.9 * y - 0.1)) > 0.15 + 0.05
    inside = np.maximum(np.abs(2.9 * x - 0.6), np.abs(2.9 * y - 0.2)) - 0.3
    dark, bright = sees_wall & (inside < -0.03), sees_wall & (inside > 0.03)
    lit, shadowed = render(pipeline, of, shadows=False), render(pipeline, of)
    assert dark.sum() > 20
    np.testing.assert_array_equal(shadowed[dark], 0.0)
    np.testing.assert_allclose(shadowed[bright], lit[bright], rtol=1e-6)


def test_a_lamp_amid_the_geometry_is_shadowed_all_around(pipeline: Pipeline) -> None:
    """Six faces: a lamp in a closed box lights every wall of it but the outermost texel, and nothing outside."""
    sides = [at(0, 0, -1), at(0, 0, 1), *(rotated(axis, angle) @ at(0, 0, 1) for axis in "xy" for angle in (90, -90))]
    box, wall = drawable(quad(1.0), 0, where=sides), drawable(quad(5.0, -2.0), 1)
    of = scene([quad(1.0), quad(5.0, -2.0)], [bulb(0, 0, 0)], [WHITE], camera(5.0), [box, wall])
    assert render(pipeline, of, shadows=False)[0].max() > 0.0
    assert render(pipeline, of).max() == 0.0
    for turn in [np.eye(4), *(rotated(axis, angle) for axis in "xy" for angle in (90, -90, 180))]:
        view = replace(camera(0.0, 0.49), world_from_camera=turn @ at(0, 0, 0.99), clipping_range=(0.01, 100.0))
        inside = replace(of, camera=view)
        np.testing.assert_allclose(render(pipeline, inside), render(pipeline, inside, shadows=False), rtol=1e-6)


@pytest.mark.parametrize("tilt", [0.0, 30.0, 60.0, 80.0])
def test_a_lit_plane_has_no_acne(pipeline: Pipeline, tilt: float) -> None:
    for light in (replace(sun(), world_from_light=rotated("y", tilt)), bulb(4 * math.sin(math.radians(tilt)), 0, 1.5)):
        of = scene([quad(5.0)], [light], [WHITE])
        np.testing.assert_allclose(render(pipeline, of), render(pipeline, of, shadows=False), rtol=1e-6)


@pytest.mark.parametrize("lift", [5.0, 15.0])
def test_light_from_below_a_floor_passes_under_nothing_that_stands_on_it(pipeline: Pipeline, lift: float) -> None:
    """A sun that grazes the floor's back, and a wall that leans over the floor and faces the sun."""
    half, slant = 2.0 * math.tan(math.radians(lift)), rotated("z", 30.0)
    standing = slant @ at(0, 0, half * math.sin(math.radians(60.0))) @ rotated("y", 120.0)
    placed = [drawable(quad(5.0), 0), drawable(quad(half), 1, where=[standing])]
    below = replace(sun(), world_from_light=slant @ rotated("y", -90.0 - lift))
    of = scene([quad(5.0), quad(half)], [below], [WHITE], camera(5.0, 0.8), placed)
    assert render(pipeline, of, shadows=False).max() > 0.1
    plan = make_plan(of, RenderSettings(size=(1024, 1024)))
    lit = beauty(pipeline.render(of, plan).layers)[..., 0] > 0.0
    assert lit.sum() <= 1  # 11 and 79 where maps were offset by their slope; one lies at the wall's foot


def test_a_sphere_shadows_itself_only_behind(pipeline: Pipeline) -> None:
    """The terminator stays where NoL is 0, to within the facets of the mesh."""
    of = scene([sphere(rings=96)], [replace(sun(), world_from_light=rotated("y", 60.0))], [WHITE])
    lit, shadowed = render(pipeline, of, shadows=False), render(pipeline, of)
    facing = lit > 0.1  # NoL above 0.1: 5.7° before the terminator; facets are 1.9°
    np.testing.assert_allclose(shadowed[facing], lit[facing], rtol=1e-6)


def test_a_light_that_casts_no_shadow_casts_none(pipeline: Pipeline) -> None:
    of = above_wall(replace(bulb(0, 0, 3), casts_shadow=False), 0.4, 0.5)
    np.testing.assert_array_equal(render(pipeline, of), render(pipeline, of, shadows=False))


def test_half_opacity_casts_half_a_shadow(pipeline: Pipeline) -> None:
    """A coin a texel and sample, 64 of them under every pixel: 6 % of noise a pixel, far less over the image."""
    thin = Material("/thin", opacity=0.5, opacity_mode="presence")
    meshes = [quad(5.0), quad(1.5, 1.0)]
    placed = [drawable(meshes[0], 0), drawable(meshes[1], 1, 1)]
    of = scene(meshes, [replace(bulb(0, 0, 3), treat_as_point=True)], [WHITE, thin], camera(0.9), placed)
    ratio = render(pipeline, of, samples=64).mean() / render(pipeline, of, samples=64, shadows=False).mean()
    assert ratio == pytest.approx(0.5, abs=0.01)


def irradiance(pipeline: Pipeline, light: Light, samples: int = 256) -> float:
    """E at the wall's centre."""
    of = scene([quad(5.0)], [light], [WHITE], camera(5.0, 0.01))
    return float(render(pipeline, of, samples=samples, light_tolerance=1e-9).mean()) * math.pi


def test_a_sphere_light_gives_its_projected_solid_angle(pipeline: Pipeline) -> None:
    """E = π L (r/d)² for a sphere above the plane that faces it."""
    lamp = SphereLight(path="/l", world_from_light=at(0, 0, 2.0), color=(1, 1, 1), intensity=2.0, radius=1.0)
    assert irradiance(pipeline, lamp) == pytest.approx(math.pi * 2.0 / 4.0, rel=5e-3)


def test_a_disk_light_gives_its_closed_form(pipeline: Pipeline) -> None:
    """E = π L r² / (r² + d²) on the axis of a parallel disk."""
    lamp = DiskLight(path="/l", world_from_light=at(0, 0, 1.0), color=(1, 1, 1), intensity=2.0, radius=1.0)
    assert irradiance(pipeline, lamp) == pytest.approx(math.pi, rel=5e-3)


def test_a_rect_light_gives_its_closed_form(pipeline: Pipeline) -> None:
    """Four quarters a x b at distance c (Howell's factor B-3), L at the corner below."""
    a, b, c = 1.0, 0.5, 1.0
    quarter = a / math.hypot(a, c) * math.atan(b / math.hypot(a, c)) + b / math.hypot(b, c) * math.atan(
        a / math.hypot(b, c)
    )
    lamp = RectLight(path="/l", world_from_light=at(0, 0, c), color=(1, 1, 1), intensity=2.0, width=2 * a, height=2 * b)
    assert irradiance(pipeline, lamp) == pytest.approx(4 * 2.0 * quarter / 2, rel=5e-3)


def test_a_wide_distant_light_gives_its_projected_solid_angle(pipeline: Pipeline) -> None:
    """E = π L sin²(half the angle)."""
    lamp = DistantLight(path="/l", world_from_light=np.eye(4), color=(1, 1, 1), intensity=2.0, angle=60.0)
    assert irradiance(pipeline, lamp) == pytest.approx(math.pi * 2.0 * 0.25, rel=5e-3)


@pytest.mark.parametrize(
    "light",
    [
        SphereLight(path="/l", world_from_light=at(0, 0, 0) @ np.diag([1, 2, 0.5, 1]), color=(1, 1, 1), radius=0.01),
        DiskLight(path="/l", world_from_light=np.diag([-1.0, 3.0, 1.0, 1.0]), color=(1, 1, 1), radius=0.01),
        RectLight(path="/l", world_from_light=rotated("x", 30.0), color=(1, 1, 1), width=0.02, height=0.01),
        CylinderLight(path="/l", world_from_light=rotated("z", 40.0), color=(1, 1, 1), radius=0.01, length=0.03),
        DistantLight(path="/l", world_from_light=rotated("x", 20.0), color=(1, 1, 1), angle=2.0),
    ],
)
@pytest.mark.parametrize("normalize", [False, True])
def test_surface_points_average_to_the_far_field(light: Light, normalize: bool) -> None:
    """Seen along the axis from afar: the mean of I cosθ over the surface is I of the far field.

    An ellipsoid's far field is its mean over all directions, so its samples are averaged over directions too.
    """
    light = replace(light, normalize=normalize)
    grid = (np.arange(64) + 0.5) / 64
    emitters = [emitter_at(light, (u, v, 0.5), np.array([0.0, 0.0, -9.0])) for u in grid for v in grid]
    intensity = np.array([e.intensity[0] for e in emitters])
    if light.kind == "sphere":
        mean = (intensity / 4).mean()  # the mean of max(cosθ, 0) over the sphere of directions
    elif light.kind == "distant":
        mean = float((intensity * [np.dot(e.axis, light.axis) for e in emitters]).mean())
    else:
        away = light.axis
        mean = (intensity * [max(np.dot(e.facing, away), 0.0) for e in emitters]).mean()
    assert mean == pytest.approx(far_field(light).intensity[0], rel=2e-3)


@pytest.mark.parametrize("inside", [True, False])
@pytest.mark.parametrize("distance", [1.1, 1.5, 4.0])
def test_points_of_a_sphere_give_its_closed_form_wherever_it_is_seen_from(distance: float, inside: bool) -> None:
    """E = π L (r/d)², r = 1, on a surface that faces it; the ball's points are drawn for what lies elsewhere."""
    lamp = SphereLight(path="/l", world_from_light=rotated("x", 30.0), color=(1, 1, 1), radius=1.0)
    here, elsewhere = np.array([0.0, distance, 0.0]), np.array([3.0, -1.0, 2.0])
    irradiance = 0.0
    for i in range(4096):
        emitter = emitter_at(lamp, owen_sobol_3d(i, 5), elsewhere, inside=inside)
        l = emitter.position - here  # noqa: E741
        facing = (
            1.0 if emitter.profile == "uniform" else max(float(-l @ emitter.facing) / float(np.linalg.norm(l)), 0.0)
        )
        irradiance += emitter.intensity[0] * facing * max(-l[1], 0.0) / float(np.linalg.norm(l)) ** 3 / 4096
    assert irradiance == pytest.approx(math.pi / distance**2, rel=0.02 if distance < 1.2 else 3e-3)


def test_a_ball_has_no_point_that_is_wasted() -> None:
    lamp = SphereLight(path="/l", world_from_light=np.eye(4), color=(1, 1, 1), radius=0.7)
    emitters = [emitter_at(lamp, owen_sobol_3d(i, 5), np.array([0.0, -5.0, 0.0])) for i in range(64)]
    assert len({tuple(e.intensity) for e in emitters}) == 1
    assert max(np.linalg.norm(e.position) for e in emitters) <= 0.7


def test_geometry_within_a_sphere_light_keeps_its_points_on_the_surface() -> None:
    lamp = replace(bulb(0, 0, 0.6), radius=0.5)
    assert make_plan(scene([quad(5.0)], [lamp]), RenderSettings()).lights[0].is_empty
    assert not make_plan(scene([quad(5.0)], [replace(lamp, radius=0.7)]), RenderSettings()).lights[0].is_empty
    around = scene(
        [quad(5.0, -5.0), quad(5.0, 5.0)], [replace(lamp, radius=0.7)]
    )  # boxes around all, triangles far off
    assert make_plan(around, RenderSettings()).lights[0].is_empty


@pytest.mark.parametrize("slant", [(0.0, 0.0), (2.0, 0.0), (-1.5, 1.5)])
def test_shadows_are_as_large_as_they_should_be(pipeline: Pipeline, slant: tuple[float, float]) -> None:
    """Edges where they belong to a tenth of a texel: the area of a square's shadow, texels being 1 % of its side."""
    lamp = bulb(*slant, 2.5)
    of = scene([quad(5.0), quad(0.4, 0.5)], [replace(lamp, treat_as_point=True)], [WHITE], camera(5.0, 0.35))
    hidden = render(pipeline, of, samples=32) < 0.5 * render(pipeline, of, samples=32, shadows=False)
    x = 0.35 * 5.0 * ((np.arange(64) + 0.5) / 32 - 1)
    scale = 2.5 / 2.0
    centre = [w * (1 - scale) for w in slant]
    inside = np.maximum(np.abs(x[None, :] - centre[0]), np.abs(-x[:, None] - centre[1])) < 0.4 * scale
    occluder = np.maximum(np.abs(x[None, :]), np.abs(x[:, None])) < 0.4 * 5.0 / 4.5 + 0.06
    np.testing.assert_array_equal(hidden[~occluder], inside[~occluder])


def test_a_point_stays_a_point() -> None:
    lamp = replace(bulb(0, 0, 1), treat_as_point=True)
    np.testing.assert_array_equal(emitter_at(lamp, (0.3, 0.8, 0.1), np.zeros(3)).position, far_field(lamp).position)


def test_as_many_spots_as_there_are_cast_their_shadows(pipeline: Pipeline) -> None:
    """More single maps than a block of the shaders holds: the sum is that of spots drawn a few at a time."""
    x, y = (0.02 * np.stack(np.divmod(np.arange(400), 20)) - 0.2).tolist()
    spots = [bulb(*place, 3.0, intensity=0.1, cone=20.0) for place in zip(x, y, strict=True)]
    of = above_wall(spots[0], 0.4, 0.5)
    apart = [render(pipeline, replace(of, lights=tuple(spots[k : k + 100]))) for k in range(0, 400, 100)]
    together = render(pipeline, replace(of, lights=tuple(spots)))
    assert np.median(np.abs(together - sum(apart)) / together.max()) < 1e-3
    assert np.abs(together - sum(apart)).mean() < 0.01 * together.mean()
