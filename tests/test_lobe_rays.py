"""Lobes see skies and lamps by rays of each pixel's own, and rays find what is in their way."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from build import at, camera, drawable, quad, rotated, scene, sphere
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.lobe_rays import in_texels
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.passes.screen import WHOLE
from defshade_cli.plan import Plan, make_plan
from defshade_cli.scene.environment import Environment
from defshade_cli.scene.light import CylinderLight, DiskLight, DistantLight, DomeLight, Light, RectLight, SphereLight
from defshade_cli.scene.linking import Links
from defshade_cli.scene.material import Material
from defshade_cli.scene.radiance_map import RadianceMap
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.shadow import ShadowStyle
from defshade_cli.scene.shaping import Shaping
from defshade_cli.scene.triangle_tree import TriangleTree, triangle_tree
from defshade_cli.settings import RenderSettings

DOME = DomeLight(path="/dome", world_from_light=np.eye(4), color=(1, 1, 1))
GLOSSY = Material("/glossy", diffuse_color=(0.2, 0.2, 0.2), roughness=0.3, clearcoat=0.5, clearcoat_roughness=0.1)
_PROBE = """
#include "lib/rays.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Rays { vec4 rays[]; };
layout(std430, binding = 1) writeonly buffer Results { uint results[]; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (2u * i >= uint(rays.length())) return;
    results[i] = uint(meets_anything(rays[2u * i].xyz, rays[2u * i + 1u].xyz, rays[2u * i].w));
}
"""


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def without_rays(plan: Plan) -> Plan:
    return replace(plan, lights=tuple(replace(p, by_rays=False) for p in plan.lights), lobe_rays=0)


SETTINGS = RenderSettings(size=(32, 32), background=False)


def planned(of: Scene, samples: int = 16) -> Plan:
    return make_plan(of, replace(SETTINGS, samples=samples))


def test_a_tree_holds_every_triangle_in_boxes_within_boxes() -> None:
    of = scene([sphere(), quad(2.0, -1.0)], [DOME])
    tree = triangle_tree(of)
    boxes, leaves = tree.boxes, tree.corners.reshape(tree.leaves, -1, 3)
    assert (leaves >= boxes[tree.leaves :, None, 0]).all() and (leaves <= boxes[tree.leaves :, None, 1]).all()
    parents = np.arange(2, len(boxes)) // 2
    assert (boxes[2:, 0] >= boxes[parents, 0]).all() and (boxes[2:, 1] <= boxes[parents, 1]).all()
    drawn = np.concatenate([mesh.points[mesh.triangles] for mesh in of.meshes]) - tree.centre
    assert {tuple(t) for t in drawn.astype(np.float32).reshape(-1, 9)} == {
        tuple(t) for t in tree.corners.reshape(-1, 9)
    }


@pytest.mark.parametrize("away", [0.0, 1e4])
def test_packed_boxes_hold_the_boxes(away: float) -> None:
    """By half a step of the grid or more, as far as float32 tells, and by two at most; a flat root's too."""
    for of in (scene([sphere(), quad(2.0, -1.0 - away)], [DOME]), scene([quad(3.0, 1.0)], [DOME])):
        tree = triangle_tree(of)
        low, step = (each.astype(np.float64) for each in tree.grid)
        packed = tree.packed_boxes[1:, :3]
        least, greatest = (packed & 0xFFFF) * step + low, (packed >> 16) * step + low
        for outwards in (tree.boxes[1:, 0] - least, greatest - tree.boxes[1:, 1]):
            assert (outwards > 0.49 * step).all() and (outwards < 2.01 * step).all()


def test_a_tree_of_nothing_meets_nothing(gpu: Gpu) -> None:
    rays = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    assert not met(gpu, triangle_tree(scene([], [DOME])), rays).any()


def test_rays_meet_what_they_should(gpu: Gpu) -> None:
    """Against every triangle of a ball, in float64; what grazes an edge apart."""
    tree, rng = triangle_tree(scene([sphere(rings=12)], [DOME])), np.random.default_rng(1)
    rays = rng.normal(size=(2000, 2, 3))
    rays[:, 1] /= np.linalg.norm(rays[:, 1], axis=1, keepdims=True)
    clear = least_barycentric(tree, rays)
    sure = np.abs(clear) > 1e-4
    np.testing.assert_array_equal(met(gpu, tree, rays)[sure], (clear > 0.0)[sure])
    assert 0.2 < (clear > 0.0).mean() < 0.8 and sure.mean() > 0.95


def test_rays_meet_nothing_beyond_their_reach(gpu: Gpu) -> None:
    tree = triangle_tree(scene([quad()], [DOME]))
    rays = np.array([[[0.1, 0.2, 3.0], [0.0, 0.0, -1.0]]])
    assert met(gpu, tree, rays, reach=3.001).all() and not met(gpu, tree, rays, reach=2.999).any()


def met(gpu: Gpu, tree: TriangleTree, rays: NDArray[np.float64], reach: float = 1e30) -> NDArray[np.bool_]:
    """(R,) what lib/rays.glsl says of rays (R, 2, 3), origins from the tree's centre."""
    program = gpu.shaders.compute("rays_probe.comp", [], {"rays_probe.comp": _PROBE})
    program["tree_shape"], program["tree_from_relative"] = (tree.leaves, tree.leaf_size), (0.0, 0.0, 0.0)
    program["grid_low"], program["grid_step"] = (tuple(each.tolist()) for each in tree.grid)
    texels = in_texels(rays.astype(np.float32))
    texels[:, 0, 3] = reach
    buffers = {0: texels, 9: tree.packed_boxes, 10: in_texels(tree.edges)}
    kept = [gpu.context.buffer(rows.tobytes()) for rows in buffers.values()]
    results = gpu.context.buffer(reserve=4 * len(rays))
    for binding, buffer in zip([*buffers, 1], [*kept, results], strict=True):
        buffer.bind_to_storage_buffer(binding)
    program.run(-(-len(rays) // 64))
    return np.frombuffer(results.read(), np.uint32) > 0


def least_barycentric(tree: TriangleTree, rays: NDArray[np.float64]) -> NDArray[np.float64]:
    """(R,) of the triangle before the ray that it is most within; below 0 outside of all."""
    first, along, aside = np.moveaxis(tree.corners.astype(np.float64), 1, 0)
    along, aside, direction = along - first, aside - first, rays[:, None, 1]
    p, s = np.cross(direction, aside), rays[:, None, 0] - first
    with np.errstate(all="ignore"):
        scale, q = 1.0 / (along * p).sum(-1), np.cross(s, along)
        u, v, t = (s * p).sum(-1) * scale, (direction * q).sum(-1) * scale, (aside * q).sum(-1) * scale
        least = np.nan_to_num(np.minimum(np.minimum(u, v), 1.0 - u - v), nan=-1.0)
    return np.where(t > 0.0, least, -1.0).max(axis=1)


def test_rays_and_directions_have_the_same_mean(pipeline: Pipeline) -> None:
    """A coated ball before a wall under a sky with a bright half: what either finds is the integral; 3 % by chance."""
    sky = np.ones((16, 32, 3), np.float32)
    sky[:, 16:] = 4.0
    of = scene([sphere(), quad(3.0, -1.0)], [replace(DOME, environment=Environment(sky))], [GLOSSY])
    plan = planned(of, 32)
    by_rays, by_directions = (pipeline.render(of, p).layers["beauty"][..., :3] for p in (plan, without_rays(plan)))
    np.testing.assert_allclose(by_rays.mean(), by_directions.mean(), rtol=0.03)


PANES = RadianceMap(np.array([[[9, 1, 0], [0, 3, 1]], [[1, 1, 1], [0, 0, 0]]], np.float32))
ASIDE = at(-1.2, 0.9, 2.0) @ rotated("x", -20.0) @ rotated("y", -30.0)
SHEAR = np.array([[-0.8, 0.3, 0, 0], [0, 0.6, 0.2, 0], [0.1, 0, 1.2, 0], [0, 0, 0, 1]])
COMMON = {"path": "/lamp", "color": (1, 0.8, 0.6), "intensity": 3.0}
LAMPS: dict[str, Light] = {
    "ball": SphereLight(**COMMON, world_from_light=ASIDE, radius=0.8),
    "ball that holds something": SphereLight(**COMMON, world_from_light=at(1.2, -0.9, 2.0), radius=0.7),
    "ellipsoid": SphereLight(**COMMON, world_from_light=ASIDE @ SHEAR, radius=0.9),
    "disk, mirrored and sheared": DiskLight(**COMMON, world_from_light=ASIDE @ SHEAR, radius=0.9),
    "rect": RectLight(**COMMON, world_from_light=ASIDE, width=2.0),
    "rect with an image": RectLight(**COMMON, world_from_light=ASIDE @ SHEAR, width=2.0, radiance_map=PANES),
    "cylinder": CylinderLight(**COMMON, world_from_light=ASIDE @ SHEAR, radius=0.4, length=2.0),
    "distant": DistantLight(**COMMON, world_from_light=rotated("y", -20.0), angle=50.0),
    "cone": DiskLight(
        **COMMON, world_from_light=ASIDE, radius=0.9, shaping=Shaping(focus=2.0, cone_angle=50.0, cone_softness=0.5)
    ),
}


METAL = Material("/metal", diffuse_color=(1, 1, 1), metallic=1.0, roughness=0.5)


@pytest.mark.parametrize("lamp", LAMPS.values(), ids=LAMPS.keys())
def test_rays_and_points_have_the_same_mean(pipeline: Pipeline, lamp: Light) -> None:
    """A metal ball before a metal wall, all lobes: the part of the rays is what the points leave; 2 % by chance."""
    meshes = [sphere(rings=12), quad(3.0, -1.0), quad(0.05)]
    placed = [drawable(mesh, i, 0, [at(1.2, -0.9, 2.0)] if i == 2 else None) for i, mesh in enumerate(meshes)]
    of = scene(meshes, [lamp], [METAL], drawables=placed)
    plan = make_plan(of, RenderSettings(size=(16, 16), samples=512, background=False, shadows=False))
    assert plan.lobe_rays == 1
    by_rays, by_points = (pipeline.render(of, p).layers["beauty"][..., :3] for p in (plan, without_rays(plan)))
    np.testing.assert_allclose(by_rays.mean(axis=(0, 1)), by_points.mean(axis=(0, 1)), rtol=0.02)


def test_lamps_are_hidden_from_rays_as_from_points(pipeline: Pipeline) -> None:
    """A lamp before a wall, behind a black blind that leaves half of it."""
    lamp = RectLight(**COMMON, world_from_light=at(0.0, 0.0, 3.0), width=3.0, height=3.0)
    black = Material("/black", use_specular_workflow=True, diffuse_color=(0, 0, 0))
    meshes = [quad(3.0, -1.0), quad()]
    placed = [drawable(meshes[0]), drawable(meshes[1], 1, 1, [at(1.0, 0.0, 2.5)])]
    of = scene(meshes, [lamp], [METAL, black], drawables=placed)
    plan = planned(of, 32)
    hidden, points = (pipeline.render(of, p).layers["beauty"][..., :3].mean() for p in (plan, without_rays(plan)))
    open_air = pipeline.render(of, make_plan(of, replace(SETTINGS, samples=32, shadows=False))).layers["beauty"]
    assert hidden == pytest.approx(points, rel=0.03) and hidden < 0.85 * open_air[..., :3].mean()


def test_light_from_everywhere_comes_back_from_white_metal(pipeline: Pipeline) -> None:
    """A distant light of 360 degrees is a white furnace, which few points know with much noise."""
    all_around = DistantLight(path="/all", world_from_light=np.eye(4), color=(1, 1, 1), angle=360.0, intensity=1.0)
    of = scene([quad(3.0)], [all_around], [replace(METAL, roughness=0.2)], camera(4.9))
    image = pipeline.render(of, planned(of, 16)).layers["beauty"][..., :3]
    np.testing.assert_allclose(image, 0.998, atol=0.1)
    assert image.mean() == pytest.approx(0.998, abs=0.01)


def test_lamps_are_seen_by_rays_where_that_gains() -> None:
    def seen(light: Light, material: Material = GLOSSY, samples: int = 16) -> bool:
        plan = make_plan(scene([quad()], [light], [material]), RenderSettings(samples=samples))
        assert (plan.lobe_rays > 0) == plan.lights[0].by_rays
        return plan.lobe_rays > 0

    ball, small, dot = LAMPS["ball"], replace(LAMPS["rect"], width=0.2, height=0.2), replace(LAMPS["ball"], radius=0.2)
    assert seen(ball) and seen(small) and seen(ball, samples=1) and not seen(small, samples=1)
    assert seen(dot, samples=2048) and not seen(dot)
    assert not seen(ball, Material("/rough", roughness=1.0))
    plain = RenderSettings(samples=1, light_points=1)
    assert make_plan(scene([quad()], [ball], [GLOSSY]), plain).lobe_rays == 0
    assert not seen(replace(ball, radius=1e-4)) and not seen(replace(ball, treat_as_point=True))
    assert not seen(ball, replace(GLOSSY, opacity=0.5))
    assert not seen(replace(ball, shadow=ShadowStyle(color=(1, 0, 0))))
    assert seen(replace(ball, shadow=ShadowStyle(color=(1, 0, 0)), casts_shadow=False))
    assert not seen(replace(ball, links=Links(np.array([True]), np.array([False]))))


def test_rays_are_left_to_directions_where_they_would_not_know_enough() -> None:
    solid = scene([quad()], [DOME], [GLOSSY])
    assert planned(solid).lobe_rays == 1 and planned(solid, 1).lobe_rays == 4
    assert planned(scene([quad()], [DOME], [replace(GLOSSY, opacity=0.5)])).lobe_rays == 0
    assert planned(scene([quad()], [replace(DOME, shadow=ShadowStyle(color=(1, 0, 0)))], [GLOSSY])).lobe_rays == 0
    linked = replace(DOME, links=Links(np.array([True]), np.array([False])))
    assert planned(scene([quad()], [linked], [GLOSSY])).lobe_rays == 0
    assert planned(replace(solid, lights=())).lobe_rays == 0


@pytest.mark.parametrize("far", [0.0, 1e8 / 3.0])
def test_a_floor_does_not_hide_the_sky_from_itself(pipeline: Pipeline, far: float) -> None:
    """However far away something else is, which the tree's triangles are rounded by."""
    metal = replace(GLOSSY, diffuse_color=(1.0, 1.0, 1.0), metallic=1.0, clearcoat=0.0)
    of = scene([quad(3.0), *[quad(1.0, -far)] * bool(far)], [DOME], [metal], camera(4.9))
    image = pipeline.render(of, planned(of, 4)).layers["beauty"]
    assert image[..., :3].mean() > 0.95


def test_surfaces_too_rough_for_small_lamps_send_no_rays() -> None:
    def limit(radius: float) -> float:
        lamp = DiskLight(**COMMON, world_from_light=at(0.0, 0.0, 10.0), radius=radius)
        return planned(scene([quad()], [lamp], [GLOSSY])).roughest_rays

    assert limit(0.5) == pytest.approx(np.sqrt(4.0 * 0.05)) and limit(5.0) == 0.7
    assert planned(scene([quad()], [DOME], [GLOSSY])).roughest_rays == 0.7


def test_tiles_that_send_no_rays_are_not_missed(pipeline: Pipeline, monkeypatch: pytest.MonkeyPatch) -> None:
    """A glossy ball in one tile of a rough wall: the picture is that of rays from all tiles."""
    meshes = [quad(3.0, -1.0), sphere(0.3, rings=8)]
    placed = [drawable(meshes[0], material=1), drawable(meshes[1], 1, 0, [at(0.8, 0.8, 0.0)])]
    of = scene(meshes, [LAMPS["rect"], DOME], [GLOSSY, Material("/rough", roughness=1.0)], drawables=placed)
    plan = make_plan(of, replace(SETTINGS, size=(96, 96), samples=2))
    sharp = pipeline.render(of, plan).layers["beauty"]
    monkeypatch.setattr("defshade_cli.passes.sharp_tiles.regions_of", lambda *_: WHOLE)
    np.testing.assert_array_equal(sharp, pipeline.render(of, plan).layers["beauty"])
    monkeypatch.setattr("defshade_cli.passes.sharp_tiles.regions_of", lambda *_: WHOLE[:0])
    assert not np.array_equal(sharp, pipeline.render(of, plan).layers["beauty"])
