"""Lobes see a dome by rays of each pixel's own, and rays find what is in their way."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from build import camera, quad, scene, sphere
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.passes.sky_rays import in_texels
from defshade_cli.plan import Plan, make_plan
from defshade_cli.scene.environment import Environment
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.linking import Links
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.shadow import ShadowStyle
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
    if (2u * i < uint(rays.length())) results[i] = uint(meets_anything(rays[2u * i].xyz, rays[2u * i + 1u].xyz));
}
"""


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def planned(of: Scene, samples: int = 16) -> Plan:
    return make_plan(of, RenderSettings(size=(32, 32), samples=samples, background=False))


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


def met(gpu: Gpu, tree: TriangleTree, rays: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(R,) what lib/rays.glsl says of rays (R, 2, 3), origins from the tree's centre."""
    program = gpu.shaders.compute("rays_probe.comp", [], {"rays_probe.comp": _PROBE})
    program["tree_shape"], program["tree_from_relative"] = (tree.leaves, tree.leaf_size), (0.0, 0.0, 0.0)
    buffers = {0: in_texels(rays.astype(np.float32)), 9: in_texels(tree.boxes), 10: in_texels(tree.edges)}
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
    by_rays, by_directions = (
        pipeline.render(of, p).layers["beauty"][..., :3] for p in (plan, replace(plan, sky_rays=0))
    )
    np.testing.assert_allclose(by_rays.mean(), by_directions.mean(), rtol=0.03)


def test_rays_are_left_to_directions_where_they_would_not_know_enough() -> None:
    solid = scene([quad()], [DOME], [GLOSSY])
    assert planned(solid).sky_rays == 1 and planned(solid, 1).sky_rays == 4
    assert planned(scene([quad()], [DOME], [replace(GLOSSY, opacity=0.5)])).sky_rays == 0
    assert planned(scene([quad()], [replace(DOME, shadow=ShadowStyle(color=(1, 0, 0)))], [GLOSSY])).sky_rays == 0
    linked = replace(DOME, links=Links(np.array([True]), np.array([False])))
    assert planned(scene([quad()], [linked], [GLOSSY])).sky_rays == 0
    assert planned(replace(solid, lights=())).sky_rays == 0


@pytest.mark.parametrize("far", [0.0, 1e8 / 3.0])
def test_a_floor_does_not_hide_the_sky_from_itself(pipeline: Pipeline, far: float) -> None:
    """However far away something else is, which the tree's triangles are rounded by."""
    metal = replace(GLOSSY, diffuse_color=(1.0, 1.0, 1.0), metallic=1.0, clearcoat=0.0)
    of = scene([quad(3.0), *[quad(1.0, -far)] * bool(far)], [DOME], [metal], camera(4.9))
    image = pipeline.render(of, planned(of, 4)).layers["beauty"]
    assert image[..., :3].mean() > 0.95
