"""UsdGeomCamera and UsdRenderSettings in scene terms, and which camera renders."""

from __future__ import annotations

import itertools
import logging
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pxr import UsdGeom

from defshade_cli.errors import PrimNotFound, StageError
from defshade_cli.plan import make_plan
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.window import DataWindow
from defshade_cli.settings import RenderSettings
from defshade_cli.spaces import transform_points
from defshade_cli.usd.camera import FRAMED, find_cameras, framed_camera
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader
from stages import reasons, stage_of

CUBE = 'def Cube "cube" {\n}\n'


def read(text: str, frame: float | None = None, metadata: str = "", **options: str) -> Scene:
    return StageReader(stage_of(CUBE + text, metadata), ReadOptions(**options)).read(frame)


def camera(body: str, frame: float | None = None) -> Camera:
    return read(f'def Camera "cam" {{\n{body}\n}}', frame).camera


# Which camera


def test_the_only_camera_renders() -> None:
    assert read('def Xform "rig" {\ndef Camera "cam" {\n}\n}').camera.path == "/rig/cam"


TWO = 'def Camera "left" {\n}\ndef Xform "b" {\ndef Camera "right" {\n}\n}\n'


@pytest.mark.parametrize("wanted", ["/b/right", "right"])
def test_a_camera_is_found_by_path_and_by_name(wanted: str) -> None:
    reader = StageReader(stage_of(CUBE + TWO), ReadOptions(camera=wanted))
    assert reader.camera_name == "right"
    assert reader.read(None).camera.path == "/b/right"


def test_a_missing_camera_lists_the_others() -> None:
    with pytest.raises(PrimNotFound, match="no camera top; there are /left, /b/right"):
        StageReader(stage_of(TWO), ReadOptions(camera="top"))


def test_a_missing_camera_of_a_stage_without_any() -> None:
    with pytest.raises(PrimNotFound, match="no camera /cube; the stage has none"):
        StageReader(stage_of(CUBE), ReadOptions(camera="/cube"))


def test_an_ambiguous_name_lists_its_cameras() -> None:
    text = 'def Xform "a" {\ndef Camera "cam" {\n}\n}\ndef Xform "b" {\ndef Camera "cam" {\n}\n}'
    with pytest.raises(PrimNotFound, match="2 cameras are named cam: /a/cam, /b/cam"):
        StageReader(stage_of(text), ReadOptions(camera="cam"))


def test_the_render_settings_camera_goes_before_the_rule_of_one() -> None:
    settings = 'def RenderSettings "settings" {\nrel camera = </b/right>\n}'
    assert read(TWO + settings, metadata='renderSettingsPrimPath = "/settings"').camera.path == "/b/right"


def test_a_named_camera_goes_before_the_render_settings() -> None:
    settings = 'def Scope "Render" {\ndef RenderSettings "settings" {\nrel camera = </b/right>\n}\n}'
    assert read(TWO + settings, camera="left").camera.path == "/left"


def test_of_several_cameras_none_is_guessed(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "defshade"):
        assert read(TWO).camera.path == FRAMED
    assert "2 cameras" in caplog.text


def test_render_settings_may_name_what_is_no_camera(caplog: pytest.LogCaptureFixture) -> None:
    settings = 'def Camera "cam" {\n}\ndef RenderSettings "settings" {\nrel camera = </cube>\n}'
    assert read(settings, metadata='renderSettingsPrimPath = "/settings"').camera.path == "/cam"
    assert "/cube, which is no camera" in caplog.text


def test_a_camera_inside_an_instance_is_found_at_each() -> None:
    rig = """class "rig" {
        def Camera "cam" {
        }
    }
    def Xform "a" (instanceable = true
        inherits = </rig>) {
        double3 xformOp:translate = (1, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Xform "b" (instanceable = true
        inherits = </rig>) {
        double3 xformOp:translate = (2, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }"""
    assert find_cameras(stage_of(rig)) == ("/a/cam", "/b/cam")
    assert read(rig, camera="/b/cam").camera.position.tolist() == [2, 0, 0]


# What a camera is


def test_apertures_are_tangents() -> None:
    assert camera("").window == pytest.approx((-0.20955, 0.20955, -0.152908, 0.152908), rel=1e-6)


def test_offsets_shift_the_window() -> None:
    left, right, bottom, top = camera("float horizontalApertureOffset = 2\nfloat verticalApertureOffset = -1").window
    assert (left + right) / 2 == pytest.approx(2 / 50)
    assert (bottom + top) / 2 == pytest.approx(-1 / 50)


def test_an_orthographic_aperture_is_in_tenths_of_a_unit() -> None:
    text = """token projection = "orthographic"
        float horizontalAperture = 40
        float verticalAperture = 20
        float horizontalApertureOffset = 10
        float2 clippingRange = (-5, 10)"""
    ortho = camera(text)
    assert ortho.projection == "orthographic"
    assert ortho.window == pytest.approx((-1, 3, -1, 1))
    assert ortho.clipping_range == (-5, 10), "an orthographic camera may see behind itself"


def test_the_lens_is_in_scene_units() -> None:
    lens = camera("float fStop = 2.8\nfloat focusDistance = 7\nfloat focalLength = 35")
    assert (lens.f_stop, lens.focus_distance, lens.focal_length) == pytest.approx((2.8, 7, 3.5))


def test_exposure_is_what_usd_computes() -> None:
    text = """float exposure = 1
        float exposure:iso = 200
        float exposure:time = 0.5
        float exposure:fStop = 2
        float exposure:responsivity = 3"""
    assert camera(text).exposure == pytest.approx(3 * 0.5 * 2 * 2 / 4)
    assert camera("").exposure == 1.0


def test_shutter_is_around_the_frame() -> None:
    assert camera("double shutter:open = -0.25\ndouble shutter:close = 0.25").shutter == (-0.25, 0.25)


def test_a_camera_ignores_scale_and_keeps_its_place() -> None:
    text = """double3 xformOp:translate = (1, 2, 3)
        float xformOp:rotateY = 90
        float3 xformOp:scale = (2, 0.5, 3)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY", "xformOp:scale"]"""
    placed = camera(text)
    np.testing.assert_allclose(placed.world_from_camera[:3, :3] @ [0, 0, -1], [-1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(
        placed.world_from_camera[:3, :3].T @ placed.world_from_camera[:3, :3], np.eye(3), atol=1e-12
    )
    assert placed.position.tolist() == [1, 2, 3]


def test_a_camera_moves_with_its_parents() -> None:
    text = """def Xform "dolly" {
        double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 11: (10, 0, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Camera "cam" {
            float focalLength.timeSamples = { 1: 50, 11: 100 }
        }
    }"""
    middle = read(text, 6).camera
    assert middle.position.tolist() == [5, 0, 0]
    assert middle.window[1] == pytest.approx(20.955 / 2 / 75)


@pytest.mark.parametrize(
    ("authored", "usable"),
    [((0.1, 5), (0.1, 5)), ((0, 5), (5e-6, 5)), ((-1, 5), (5e-6, 5)), ((5, 5), (1, 1e6)), ((-5, -1), (1, 1e6))],
)
def test_the_near_plane_is_in_front(authored: tuple[float, float], usable: tuple[float, float]) -> None:
    assert camera(f"float2 clippingRange = {authored}").clipping_range == pytest.approx(usable)


def test_an_aperture_without_area_sees_nothing() -> None:
    with pytest.raises(StageError, match="camera /cam sees nothing"):
        camera("float horizontalAperture = 0")


def test_clipping_planes_are_read_as_many_as_a_driver_has() -> None:
    scene = read('def Camera "cam" {\nfloat4[] clippingPlanes = [(1, 0, 0, 0)]\n}')
    assert scene.unsupported == ()
    np.testing.assert_array_equal(scene.camera.clipping_planes, [(1, 0, 0, 0)])
    nine = ", ".join(f"(1, 0, 0, {n})" for n in range(9))
    crowded = read(f'def Camera "cam" {{\nfloat4[] clippingPlanes = [(nan, 0, 0, 0), {nine}]\n}}')
    assert len(crowded.camera.clipping_planes) == 8
    assert reasons(crowded, "/cam") == ["2 of its 10 clippingPlanes are left out"]


# The camera that frames

finite = st.floats(-1e4, 1e4).map(lambda x: round(x, 3))
boxes = st.tuples(*[st.tuples(finite, finite).map(sorted) for _ in range(3)]).map(lambda sides: np.array(sides).T)


@given(boxes, st.sampled_from(["Y", "Z"]))
def test_framing_sees_all_of_any_box(box: np.ndarray, up_axis: str) -> None:
    camera = framed_camera(box, up_axis)
    seen = transform_points(camera.camera_from_world, np.array(list(itertools.product(*box.T))))
    near, far = camera.clipping_range
    slack = 1e-9 * (1 + np.abs(box).max())
    assert (near <= -seen[:, 2] + slack).all() and (-seen[:, 2] <= far + slack).all()
    left, right, bottom, top = camera.window
    depth = -seen[:, 2]
    assert (seen[:, 0] >= left * depth - slack).all() and (seen[:, 0] <= right * depth + slack).all()
    assert (seen[:, 1] >= bottom * depth - slack).all() and (seen[:, 1] <= top * depth + slack).all()


def test_framing_is_usdrecords() -> None:
    """UsdAppUtilsFrameRecorder: half the front face's diagonal over the tangent of half the field of view."""
    box = np.array([[-2.0, -1, -3], [4, 1, 5]])
    camera = framed_camera(box, "Y")
    distance = math.hypot(3, 1) / (20.955 / 2 / 50) + 4
    np.testing.assert_allclose(camera.position, [1, 0, 1 + distance], rtol=1e-6)
    assert camera.window[1] == pytest.approx(20.955 / 2 / 50)


def test_framing_looks_along_plus_y_where_z_is_up() -> None:
    camera = framed_camera(np.array([[-1.0, -1, -1], [1, 1, 1]]), "Z")
    np.testing.assert_allclose(camera.world_from_camera[:3, :3] @ [0, 0, -1], [0, 1, 0])
    np.testing.assert_allclose(camera.world_from_camera[:3, :3] @ [0, 1, 0], [0, 0, 1])
    assert camera.position[1] < -1


def test_a_stage_without_camera_is_framed() -> None:
    reader = StageReader(stage_of(CUBE))
    scene = reader.read(None)
    assert reader.camera_name == "framed"
    assert (scene.camera.path, scene.cameras) == (FRAMED, ())


# Render settings


def settings(body: str, camera: str = "", products: str = "", **options: str) -> Scene:
    render = f'def Scope "Render" {{\ndef RenderSettings "s" {{\n{body}\n}}\n{products}\n}}'
    text = f'def Camera "cam" {{\n{camera}\n}}\n{render}'
    return read(text, **options)


def test_the_image_follows_the_render_settings() -> None:
    scene = settings(
        'int2 resolution = (320, 180)\nfloat pixelAspectRatio = 2\ntoken aspectRatioConformPolicy = "cropAperture"'
    )
    assert (scene.resolution, scene.pixel_aspect, scene.conform) == ((320, 180), 2.0, "cropAperture")


def test_a_stage_without_settings_leaves_the_image_open() -> None:
    scene = read("")
    assert (scene.resolution, scene.pixel_aspect, scene.conform) == (None, 1.0, "expandAperture")


def test_the_product_that_is_made_goes_before_the_settings() -> None:
    product = 'def RenderProduct "p" {\nint2 resolution = (64, 48)\n}'
    body = "int2 resolution = (320, 180)\nfloat pixelAspectRatio = 2\nrel products = </Render/p>"
    made, plain = (settings(body, products=product, product=path) for path in ("/Render/p", ""))
    assert (made.resolution, made.pixel_aspect) == ((64, 48), 2.0)
    assert plain.resolution == (320, 180)


def test_pixels_may_stretch_over_the_aperture() -> None:
    scene = settings(
        'int2 resolution = (200, 100)\ntoken aspectRatioConformPolicy = "adjustPixelAspectRatio"',
        "float horizontalAperture = 30\nfloat verticalAperture = 10",
    )
    assert scene.pixel_aspect == pytest.approx(1.5)
    assert scene.camera.conformed(200 * scene.pixel_aspect / 100).window == pytest.approx(scene.camera.window)


LENS = "double shutter:open = -0.25\ndouble shutter:close = 0.25\nfloat fStop = 4"


@pytest.mark.parametrize(
    ("body", "shutter", "f_stop"),
    [
        ("", (-0.25, 0.25), 4.0),
        ("bool disableMotionBlur = true", (0.0, 0.0), 4.0),
        ("bool instantaneousShutter = true", (-0.25, -0.25), 4.0),
        ("bool disableDepthOfField = true", (-0.25, 0.25), 0.0),
    ],
)
def test_effects_can_be_switched_off(body: str, shutter: tuple[float, float], f_stop: float) -> None:
    camera = settings(body, LENS).camera
    assert (camera.shutter, camera.f_stop) == (shutter, f_stop)


def test_a_data_window_renders_a_part() -> None:
    scene = settings("float4 dataWindowNDC = (0, 0, 0.5, 1)\nint2 resolution = (64, 48)")
    plan = make_plan(scene, RenderSettings())
    assert (plan.window, plan.display) == (DataWindow(0, 0, 32, 48), (64, 48))
    assert make_plan(scene, RenderSettings(crop=(-1, 2, 3, 4))).window == DataWindow(-1, 2, 3, 4)


def test_every_camera_is_listed() -> None:
    stage = stage_of(CUBE + TWO)
    UsdGeom.Imageable(stage.GetPrimAtPath("/left")).MakeInvisible()
    assert StageReader(stage).read(None).cameras == ("/left", "/b/right")
