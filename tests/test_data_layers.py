"""Data layers on scenes where their values are known in closed form, and what each of them costs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from build import camera, drawable, quad, rotated, scene, sphere, sun
from defshade_cli import render
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.layers import LAYERS
from defshade_cli.image.metadata import world_to_camera, world_to_ndc
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import Plan, make_plan
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.geometry import Mesh
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings
from defshade_cli.spaces import normalize, transform_directions

SIZE = (64, 64)
COATED = Material("/coated", clearcoat=0.6, clearcoat_roughness=0.2, ior=2.0, occlusion=0.7)


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def plan_of(of: Scene, *layers: str, **options: object) -> Plan:
    return make_plan(of, RenderSettings(size=SIZE, layers=layers, **options))  # type: ignore[arg-type]


def drawn(pipeline: Pipeline, of: Scene, *layers: str, **options: object) -> dict[str, NDArray[np.float32]]:
    return pipeline.render(of, plan_of(of, *layers, **options)).layers


def oblique(**options: object) -> Camera:
    """Beside the +Z axis, turned, with an off-centre window."""
    view = camera(5.0, **options)  # type: ignore[arg-type]
    turned = rotated("y", 20.0) @ rotated("x", -15.0) @ view.world_from_camera
    return replace(view, world_from_camera=turned, window=(-0.4, 0.6, -0.5, 0.5))


def textured(half: float = 4.0) -> Mesh:
    """A square whose u runs up and whose v runs left, four times a unit."""
    mesh = quad(half)
    return replace(mesh, uvs={"map1": mesh.points[:, [1, 0]] * (4.0, -4.0)})


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_points_return_to_their_pixels_by_the_headers_matrices(pipeline: Pipeline, projection: str) -> None:
    """To a hundredth of a pixel, through the float32 of the layers."""
    window = (-2.0, 2.0, -2.0, 2.0) if projection == "orthographic" else None
    view = replace(oblique(), projection=projection, **({"window": window} if window else {}))
    layers = drawn(pipeline, scene([sphere()], view=view), "position", "Peye", "depth", "distance")
    covered = np.isfinite(layers["depth"][..., 0])
    points = np.column_stack([layers["position"][covered], np.ones(covered.sum())])
    ndc = points @ world_to_ndc(plan_of(scene([sphere()], view=view), "position").camera)
    rows, columns = np.nonzero(covered)
    pixels = ndc[:, :2] / ndc[:, 3:] * SIZE
    np.testing.assert_allclose(pixels, np.column_stack([columns, rows]) + 0.5, atol=0.01)
    in_camera = points @ world_to_camera(view)
    np.testing.assert_allclose(layers["Peye"][covered], in_camera[:, :3] * (1, 1, -1), atol=1e-5)
    np.testing.assert_allclose(layers["depth"][covered][:, 0], in_camera[:, 2], rtol=1e-6)
    np.testing.assert_allclose(layers["distance"][covered][:, 0], np.linalg.norm(in_camera[:, :3], axis=1), rtol=1e-6)


def test_camera_normals_are_world_normals_turned(pipeline: Pipeline) -> None:
    view = oblique()
    layers = drawn(pipeline, scene([sphere()], view=view), "normal", "Neye")
    turned = transform_directions(view.camera_from_world, layers["normal"])
    np.testing.assert_allclose(layers["Neye"], turned, atol=1e-6)


@pytest.mark.parametrize("turn", [0.0, 180.0])
def test_geometric_normals_are_the_triangles_and_face_the_camera(pipeline: Pipeline, turn: float) -> None:
    tilted = drawable(quad(4.0), where=[rotated("y", 30.0 + turn)])
    layers = drawn(pipeline, scene([quad(4.0)], view=oblique(), drawables=[tilted]), "geometricNormal")
    expected = rotated("y", 30.0)[:3, 2]
    covered = layers["geometricNormal"].any(axis=-1)
    assert covered.mean() > 0.9
    # Differences of positions 5 units away, 0.08 apart: float32 leaves some 1e-5 of them.
    np.testing.assert_allclose(
        layers["geometricNormal"][covered], np.broadcast_to(expected, (covered.sum(), 3)), atol=1e-4
    )


def test_geometric_normals_of_a_sphere_are_near_its_smooth_ones(pipeline: Pipeline) -> None:
    layers = drawn(pipeline, scene([sphere()], view=oblique()), "geometricNormal", "normal")
    cosine = np.einsum("hwi,hwi->hw", layers["geometricNormal"], layers["normal"])
    covered = layers["normal"].any(axis=-1)
    assert cosine[covered].min() > np.cos(np.radians(5.7))  # 32 rings: a facet is 5.6° wide


def test_uv_and_tangent_follow_the_texture_coordinates(pipeline: Pipeline) -> None:
    of = scene([textured()], view=oblique())
    layers = drawn(pipeline, of, "uv", "tangent", "position")
    covered = layers["tangent"].any(axis=-1)
    expected = layers["position"][..., [1, 0]] * (4.0, -4.0)
    np.testing.assert_allclose(layers["uv"][covered], expected[covered], atol=1e-4)
    np.testing.assert_allclose(layers["tangent"][covered], np.broadcast_to([0, 1, 0], (covered.sum(), 3)), atol=1e-4)


def test_tangents_cross_shading_normals(pipeline: Pipeline) -> None:
    ball = sphere()
    around = np.arctan2(ball.points[:, 0], ball.points[:, 2]) / (2 * np.pi)
    ball = replace(ball, uvs={"st": np.column_stack([around, ball.points[:, 1]])})
    layers = drawn(pipeline, scene([ball], view=oblique()), "tangent", "normal", "position")
    covered = layers["tangent"].any(axis=-1)
    tangent, normal, position = (layers[name][covered] for name in ("tangent", "normal", "position"))
    np.testing.assert_allclose(np.einsum("pi,pi->p", tangent, normal), 0.0, atol=1e-5)
    expected = normalize(np.cross([0.0, 1.0, 0.0], position))
    assert np.median(np.einsum("pi,pi->p", tangent, expected)) > 0.999


def test_without_texture_coordinates_uv_and_tangent_are_zero(pipeline: Pipeline) -> None:
    layers = drawn(pipeline, scene([quad(4.0)]), "uv", "tangent")
    assert not layers["uv"].any() and not layers["tangent"].any()


def test_material_layers_show_the_material(pipeline: Pipeline) -> None:
    names = ("specularF0", "clearcoat", "clearcoatRoughness", "occlusion")
    layers = drawn(pipeline, scene([sphere()], materials=[COATED]), *names)
    expected = {"specularF0": 1 / 9, "clearcoat": 0.6, "clearcoatRoughness": 0.2, "occlusion": 0.7}
    for name, value in expected.items():
        np.testing.assert_allclose(layers[name][32, 32], value, rtol=1e-6)
        assert (layers[name][0, 0] == LAYERS[name].background).all()


def test_alpha_is_the_beautys_and_needs_no_light(pipeline: Pipeline) -> None:
    of = scene([sphere()], [sun()])
    alone = drawn(pipeline, of, "alpha", samples=8)["alpha"]
    both = drawn(pipeline, of, "beauty", samples=8)["beauty"][..., 3:]
    np.testing.assert_array_equal(alone, both)
    plan = plan_of(of, "alpha", samples=8)
    assert not plan.lights and not plan.planes and not plan.shadows


@pytest.mark.parametrize("name", [name for name, layer in LAYERS.items() if not layer.is_sampled])
def test_a_data_layer_costs_its_own_plane(name: str) -> None:
    of, source = scene([sphere()], [sun()], [COATED]), LAYERS[name].source
    alone = plan_of(of, name)
    assert [plane.name for plane in alone.data_planes] == ([] if source == "depth" else [source])
    assert not alone.planes and not alone.lights
    several = plan_of(of, "beauty", name, samples=4)
    assert several.data_planes == alone.data_planes
    assert several.planes == plan_of(of, "beauty").planes


def test_an_unasked_layer_costs_nothing() -> None:
    plan = plan_of(scene([sphere()], [sun()]), "beauty")
    assert [plane.name for plane in plan.planes] == ["base", "normal"] and not plan.data_planes and not plan.data_pass
    assert not plan.inputs


def test_all_layers_at_once_need_more_than_one_framebuffer(pipeline: Pipeline) -> None:
    of = scene([textured()], [sun()], [COATED], view=oblique())
    names = tuple(LAYERS)
    together = drawn(pipeline, of, *names)
    assert len(plan_of(of, *names).data_planes) > 8
    for name in ("normal", "geometricNormal", "occlusion", "uv"):
        np.testing.assert_array_equal(together[name], drawn(pipeline, of, name)[name])


def test_names_of_other_renderers_are_ours() -> None:
    of = scene([sphere()], [sun()])
    assert plan_of(of, "RGBA", "cameraDepth", "N", "Combined").layers == ("beauty", "depth", "normal")


def test_occlusion_is_read_of_a_stage_where_it_is_asked(tmp_path: Path) -> None:
    stage = tmp_path / "a.usda"
    stage.write_text("""#usda 1.0
def Mesh "wall" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    rel material:binding = </paint>
}
def Material "paint" {
    token outputs:surface.connect = </paint/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:occlusion = 0.25
        token outputs:surface
    }
}
""")
    film = render(stage, size=(16, 16), layers=("occlusion",))
    assert film.layers["occlusion"][8, 8] == 0.25 and film.layers["occlusion"].max() == 1.0
