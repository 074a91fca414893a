"""The GBuffer: what each layout stores, and how well."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from build import bulb, camera, drawable, quad, rotated, scene, sphere, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import PLANES, named_planes, needed_planes
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import Layout, RenderSettings
from defshade_cli.spaces import normalize, translation

PLASTIC = Material("/plastic", diffuse_color=(0.8, 0.25, 0.1), metallic=0.3, roughness=0.35)


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def stored(pipeline: Pipeline, of: Scene, layout: Layout) -> dict[str, NDArray]:
    """The planes of a 64x64 frame as the GPU holds them, and the stored depth."""
    plan = make_plan(of, RenderSettings(size=(64, 64), layout=layout))
    pipeline.render(of, plan)
    target = pipeline._frame.gbuffer(plan.size, plan.planes, layout).target
    return {plane.name: target.read(plane.name) for plane in plan.planes} | {"depth": target.read_depth()}


def bytes_of(value: NDArray) -> NDArray[np.uint8]:
    """GL's conversion to unorm8: the nearest of 256 steps."""
    return np.round(np.clip(value, 0, 1) * 255).astype(np.uint8)


def test_rgba8_is_the_seeds_layout_bit_for_bit(pipeline: Pipeline) -> None:
    """RT0 = diffuse + metallic, RT1 = normal xyz + roughness, R8G8B8A8, normals as n/2 + 1/2."""
    tilted = drawable(quad(5.0), where=[rotated("y", 25.0)])
    planes = stored(pipeline, scene([quad(5.0)], [sun()], [PLASTIC], drawables=[tilted]), "rgba8")
    normal = rotated("y", 25.0)[:3, 2]
    assert planes["base"].dtype == planes["normal"].dtype == np.uint8
    np.testing.assert_array_equal(planes["base"][32, 32], bytes_of(np.array([0.8, 0.25, 0.1, 0.3])))
    np.testing.assert_array_equal(planes["normal"][32, 32], bytes_of(np.array([*(normal * 0.5 + 0.5), 0.35])))
    assert planes["depth"].dtype == np.float32


def test_rgba8_keeps_the_nearest_by_less(pipeline: Pipeline) -> None:
    """0 is near: the smaller depth stays, and a clear background is 1."""
    planes = stored(pipeline, scene([quad(0.5, z=1.0), quad(1.0, z=-1.0)], [sun()]), "rgba8")
    centre, edge, corner = planes["depth"][32, 32], planes["depth"][32, 22], planes["depth"][0, 0]
    assert 0.0 < centre < edge < corner == 1.0


def test_the_other_layouts_reverse_depth(pipeline: Pipeline) -> None:
    planes = stored(pipeline, scene([quad(0.5)], [sun()]), "float")
    assert planes["depth"][0, 0] == 0.0 < planes["depth"][32, 32] < 1.0


def test_packed_normals_keep_to_the_octahedral_bound(pipeline: Pipeline) -> None:
    """12 + 12 bits: 0.021° mean, 0.059° at most (Cigolle et al. 2014; measured for all directions)."""
    of = scene([sphere()], [sun()], view=camera(4.0, 0.3))
    exact = stored(pipeline, of, "float")["normal"][..., :3].astype(np.float64)
    covered = stored(pipeline, of, "float")["depth"] > 0
    found = unpack_normals(stored(pipeline, of, "packed")["normal"])
    sine = np.linalg.norm(np.cross(exact, found), axis=-1)[covered]
    degrees = np.degrees(np.arcsin(sine))
    assert degrees.mean() < 0.025
    assert degrees.max() < 0.0592


def unpack_normals(plane: NDArray[np.uint8]) -> NDArray[np.float64]:
    """lib/encode.glsl's unit_from_bytes in NumPy."""
    b = plane[..., :3].astype(int)
    code = np.stack([b[..., 0] << 4 | b[..., 2] >> 4, b[..., 1] << 4 | b[..., 2] & 15], axis=-1)
    p = (code - 2048) / 2047
    z = 1 - np.abs(p).sum(-1)
    fold = (1 - np.abs(p[..., ::-1])) * np.where(p >= 0, 1, -1)
    n = np.concatenate([np.where(z[..., None] >= 0, p, fold), z[..., None]], axis=-1)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


@pytest.mark.parametrize("axis", np.concatenate([np.eye(3), -np.eye(3)]).tolist())
def test_packed_normals_are_exact_on_the_axes(axis: list[float]) -> None:
    """Code 2048 is 0 and ±2047 is ±1, so an axis survives the twelve bits."""
    n = np.array(axis)
    p = n[:2] if n[2] >= 0 else (1 - np.abs(n[1::-1])) * np.where(n[:2] >= 0, 1, -1)
    code = (np.round(p * 2047) + 2048).astype(int)
    plane = np.array([code[0] >> 4, code[1] >> 4, (code[0] & 15) << 4 | code[1] & 15], np.uint8)
    np.testing.assert_array_equal(unpack_normals(plane), n)


def test_packed_base_colour_is_srgb(pipeline: Pipeline) -> None:
    """sRGB8 loses at most 1.55 % at values of 0.05 and more; linear 8-bit loses 3.7 %."""
    dark = Material("/dark", diffuse_color=(0.05, 0.0617, 0.3))
    plane = stored(pipeline, scene([quad(5.0)], [sun()], [dark]), "packed")["base"][32, 32, :3] / 255
    linear = np.where(plane > 0.04045, ((plane + 0.055) / 1.055) ** 2.4, plane / 12.92)
    np.testing.assert_allclose(linear, dark.diffuse_color, rtol=0.0155)


def test_float_planes_are_exact(pipeline: Pipeline) -> None:
    planes = stored(pipeline, scene([quad(5.0)], [sun()], [PLASTIC]), "float")
    np.testing.assert_array_equal(planes["base"][32, 32], np.array([0.8, 0.25, 0.1, 0.3], np.float32))
    np.testing.assert_array_equal(planes["normal"][32, 32], np.array([0, 0, 1, 0.35], np.float32))


def test_optional_planes_exist_only_when_needed() -> None:
    assert [p.name for p in needed_planes([PLASTIC])] == ["base", "normal"]
    glowing = replace(PLASTIC, emissive_color=(0.0, 1.0, 0.0))
    coated = replace(PLASTIC, clearcoat=1.0, ior=1.8)
    lit = [p.name for p in PLANES if p.encodings["float"].read and p.name not in ("links", "weights", "triangle")]
    assert [p.name for p in needed_planes([PLASTIC, glowing, coated])] == lit
    assert [p.name for p in named_planes(["emission", "depth", "base"])] == ["base", "emission"]


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (1, -2, 3), (-1, -1, -1)])
def test_normals_face_the_camera_under_any_placement(pipeline: Pipeline, scale: tuple[float, ...]) -> None:
    """Mirrored or stretched, a sphere's normals point at the eye and stay perpendicular to its surface."""
    placed = drawable(sphere(), where=[np.diag([*scale, 1.0])])
    of = scene([sphere()], [sun()], view=camera(8.0, 0.5), drawables=[placed])
    plan = make_plan(of, RenderSettings(size=(64, 64), layers=("normal", "position")))
    layers = pipeline.render(of, plan).layers
    covered = np.linalg.norm(layers["normal"], axis=-1) > 0.5
    expected = normalize(layers["position"][covered] / np.square(scale))
    cosine = np.einsum("pi,pi->p", layers["normal"][covered], expected)
    # 32 rings: the flat facets put a pixel's point up to half a facet (2.8°) from where its normal was made.
    assert cosine.min() > math.cos(math.radians(6.0))


def test_the_back_of_a_face_is_drawn_and_faces_the_camera(pipeline: Pipeline) -> None:
    behind = drawable(quad(1.0), where=[rotated("y", 180.0)])
    of = scene([quad(1.0)], [sun()], drawables=[behind])
    layers = pipeline.render(of, make_plan(of, RenderSettings(size=(32, 32), layers=("normal",)))).layers
    np.testing.assert_allclose(layers["normal"][16, 16], [0, 0, 1], atol=1e-6)


def test_a_scene_far_from_the_origin_renders_like_one_at_the_origin(pipeline: Pipeline) -> None:
    """10^7 units away: positions reach the GPU relative to the camera. Only the light's own float64 place differs."""
    near = scene([sphere()], [sun()])
    offset = np.array([1e7, -2e7, 3e7])
    moved = replace(near.camera, world_from_camera=translation(offset) @ near.camera.world_from_camera)
    far = replace(near, camera=moved, drawables=(drawable(sphere(), where=[translation(offset)]),))
    films = [pipeline.render(s, make_plan(s, RenderSettings(size=(64, 64)))) for s in (near, far)]
    np.testing.assert_array_equal(films[0].layers["beauty"], films[1].layers["beauty"])


@pytest.mark.filterwarnings("error")
def test_a_frame_without_anything_to_draw_is_empty(pipeline: Pipeline) -> None:
    """All is hidden for now: the layers are their backgrounds, and the frame after is drawn again."""
    empty = scene([], [sun(), bulb(0, 0, 2)], [PLASTIC])
    settings = RenderSettings(size=(16, 16), layers=("beauty", "depth", "normal"))
    layers = pipeline.render(empty, make_plan(empty, settings)).layers
    assert not layers["beauty"].any() and not layers["normal"].any() and np.isinf(layers["depth"]).all()
    full = scene([quad(5.0)], [sun()], [PLASTIC])
    assert pipeline.render(full, make_plan(full, settings)).layers["beauty"].all()


def test_subsets_draw_their_own_triangles(pipeline: Pipeline) -> None:
    from defshade_cli.scene.geometry import Subset

    red, green = Material("/r", diffuse_color=(1, 0, 0)), Material("/g", diffuse_color=(0, 1, 0))
    split = replace(drawable(quad(5.0)), subsets=(Subset(0, 0, 1), Subset(1, 1, 1)))
    of = scene([quad(5.0)], [], [red, green], drawables=[split])
    albedo = pipeline.render(of, make_plan(of, RenderSettings(size=(32, 32), layers=("albedo",)))).layers["albedo"]
    np.testing.assert_array_equal(albedo[30, 30], [1, 0, 0])  # lower right: triangle 0, 1, 2
    np.testing.assert_array_equal(albedo[2, 2], [0, 1, 0])


def test_instances_bear_their_own_colour_and_vertices_theirs(pipeline: Pipeline) -> None:
    shown = Material("/shown", uses_display_color=True, uses_display_opacity=True)
    varying = replace(quad(0.4), display_color=np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], np.float32))
    left, right = translation(np.array([-1.0, 0, 0])), translation(np.array([1.0, 0, 0]))
    constant = replace(drawable(quad(0.4), 0, where=[left]), display_color=np.array([[0.2, 0.4, 0.6]], np.float32))
    of = scene([quad(0.4), varying], [], [shown], drawables=[constant, drawable(varying, 1, where=[right])])
    albedo = pipeline.render(of, make_plan(of, RenderSettings(size=(64, 64), layers=("albedo",)))).layers["albedo"]
    np.testing.assert_allclose(albedo[32, 19], [0.2, 0.4, 0.6], rtol=1e-6)
    centre = albedo[31:33, 44:46].mean((0, 1))  # on the diagonal red–blue
    np.testing.assert_allclose(centre.sum(), 1.0, atol=0.15)
    assert albedo[27, 40].min() > 0.8  # the upper left corner is white


def test_clipping_planes_cut_in_camera_space(gpu: Gpu) -> None:
    """What is right of x = 1 and below y = 0.5 for a camera behind the quad, whose x is the world's −x."""
    view = replace(camera(), clipping_planes=np.array([(-1.0, 0.0, 0.0, 1.0), (0.0, 2.0, 0.0, -1.0)]))
    turned = replace(view, world_from_camera=rotated("y", 180.0) @ view.world_from_camera)
    behind = scene([quad(half=10.0)], [sun()], view=turned)
    plan = make_plan(behind, RenderSettings(size=(40, 40), layers=("depth", "position")))
    layers = Pipeline(gpu).render(behind, plan).layers
    seen = np.isfinite(layers["depth"][..., 0])
    x, y = layers["position"][..., 0][seen], layers["position"][..., 1][seen]
    assert (-x <= 1.0).all() and (y >= 0.5).all()
    # The image is 5 units wide and high: 3.5 and 2 of them are left.
    assert seen.sum() == 28 * 16


@pytest.mark.parametrize("turned", [0.0, 90.0])
def test_one_clipping_plane_cuts_wherever_the_camera_stands(pipeline: Pipeline, turned: float) -> None:
    """What lies to the camera's left goes; the next frame without planes is whole."""
    world_from_camera = rotated("z", turned) @ translation(np.array([0.0, 0.0, 4.0]))
    whole = scene([quad(9.0)], [sun()], view=replace(camera(half=1.0), world_from_camera=world_from_camera))
    halved = replace(whole, camera=replace(whole.camera, clipping_planes=np.array([[1.0, 0.0, 0.0, 0.0]])))
    depth = stored(pipeline, halved, "float")["depth"]
    assert (depth[:, :32] == 0.0).all() and (depth[:, 32:] > 0.0).all()
    assert (stored(pipeline, whole, "float")["depth"] > 0.0).all()
