"""UsdLux lights in scene terms: photometry by the schema's text, shaping, transforms, and what is left out."""

from __future__ import annotations

import logging
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pxr import Usd, UsdLux

from defshade_cli.plan import make_plan
from defshade_cli.scene.light import CylinderLight, DiskLight, DistantLight, Light, RectLight, SphereLight
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.shaping import Shaping
from defshade_cli.settings import RenderSettings
from defshade_cli.usd.lights.light import CAMERA_LIGHT, temperature_color
from defshade_cli.usd.reader import StageReader
from stages import reasons, stage_of

CUBE = 'def Cube "cube" {\n}\n'
DEFAULT = Usd.TimeCode.Default()


def read(text: str, frame: float | None = None) -> Scene:
    return StageReader(stage_of(CUBE + text)).read(frame)


def light(kind: str, body: str = "", api: str = "") -> Light:
    schemas = f'(prepend apiSchemas = ["{api}"])' if api else ""
    (found,) = read(f'def {kind} "light" {schemas} {{\n{body}\n}}').lights
    return found


def scaled(kind: str, scale: tuple[float, float, float], body: str = "") -> Light:
    return light(kind, f'float3 xformOp:scale = {scale}\nuniform token[] xformOpOrder = ["xformOp:scale"]\n{body}')


# Kinds, defaults and values


@pytest.mark.parametrize(
    ("kind", "expected", "sizes"),
    [
        ("DistantLight", DistantLight, {"angle": 0.53}),
        ("SphereLight", SphereLight, {"radius": 0.5}),
        ("DiskLight", DiskLight, {"radius": 0.5}),
        ("RectLight", RectLight, {"width": 1, "height": 1}),
        ("CylinderLight", CylinderLight, {"radius": 0.5, "length": 1}),
    ],
)
def test_each_kind_has_the_schemas_defaults(kind: str, expected: type[Light], sizes: dict[str, float]) -> None:
    found = light(kind)
    assert type(found) is expected
    assert found.path == "/light"
    assert {name: getattr(found, name) for name in sizes} == pytest.approx(sizes)
    assert found.intensity == (50000 if kind == "DistantLight" else 1)
    assert (found.exposure, found.normalize, found.diffuse, found.specular, found.shaping) == (0, False, 1, 1, None)
    assert found.color.tolist() == [1, 1, 1]


def test_emission_is_color_times_intensity_times_two_to_the_exposure() -> None:
    found = light(
        "SphereLight", "float inputs:intensity = 3\nfloat inputs:exposure = 2\ncolor3f inputs:color = (1, 0.5, 0.25)"
    )
    np.testing.assert_allclose(found.radiance, [12, 6, 3])


def test_the_default_sun_is_3_36_lux() -> None:
    """50000 nits over the projected solid angle of half a degree."""
    sun = light("DistantLight")
    assert isinstance(sun, DistantLight)
    np.testing.assert_allclose(sun.irradiance, 50000 * math.pi * math.sin(math.radians(0.265)) ** 2, rtol=1e-6)
    assert sun.irradiance[0] == pytest.approx(3.36, abs=0.005)


def test_multipliers_and_point_hint() -> None:
    found = light("SphereLight", "float inputs:diffuse = 0.5\nfloat inputs:specular = 0\nbool treatAsPoint = 1")
    assert isinstance(found, SphereLight)
    assert (found.diffuse, found.specular, found.treat_as_point) == (0.5, 0.0, True)


# Area under scale, and normalize


@pytest.mark.parametrize(
    ("kind", "scale", "area"),
    [
        ("SphereLight", (2, 2, 2), 4 * math.pi * 1.0**2),
        ("DiskLight", (2, 4, 7), math.pi * 1.0 * 2.0),
        ("RectLight", (2, 3, 7), 6.0),
        ("CylinderLight", (3, 2, 2), 2 * math.pi * 1.0 * 3.0),
    ],
)
def test_normalize_divides_by_the_area_in_world(kind: str, scale: tuple[float, float, float], area: float) -> None:
    plain, normalized = scaled(kind, scale), scaled(kind, scale, "bool inputs:normalize = 1")
    assert plain.size_factor == pytest.approx(area)
    np.testing.assert_allclose(plain.radiance, 1)
    np.testing.assert_allclose(normalized.radiance, 1 / area)


scales = st.floats(0.01, 100.0)


@settings(max_examples=25, deadline=None)
@given(st.sampled_from(["SphereLight", "DiskLight", "RectLight", "CylinderLight"]), scales, scales)
def test_a_normalized_light_keeps_its_power_at_any_size(kind: str, scale: float, intensity: float) -> None:
    body = f"bool inputs:normalize = 1\nfloat inputs:intensity = {intensity}"
    found = scaled(kind, (scale, scale, scale), body)
    np.testing.assert_allclose(found.radiance * found.size_factor, intensity, rtol=1e-5)
    np.testing.assert_allclose(found.intensity_on_axis, light(kind, body).intensity_on_axis, rtol=1e-5)


@pytest.mark.parametrize("angle", [0.0, 0.53, 90.0, 180.0, 270.0, 360.0])
def test_a_normalized_sun_has_its_intensity_in_lux(angle: float) -> None:
    sun = light("DistantLight", f"bool inputs:normalize = 1\nfloat inputs:intensity = 2\nfloat inputs:angle = {angle}")
    assert isinstance(sun, DistantLight)
    np.testing.assert_allclose(sun.irradiance, 2)


# Colour temperature


def test_6500_kelvin_is_white() -> None:
    """UsdLux.BlackbodyTemperatureAsRgb alone is not, though the schema asks for it."""
    np.testing.assert_allclose(temperature_color(6500), 1, rtol=1e-6)
    assert np.ptp(UsdLux.BlackbodyTemperatureAsRgb(6500)) > 0.05


def test_temperature_multiplies_the_color_where_enabled() -> None:
    body = "color3f inputs:color = (1, 0.5, 0.25)\nfloat inputs:colorTemperature = 3000"
    np.testing.assert_allclose(light("RectLight", body).color, [1, 0.5, 0.25])
    warm = light("RectLight", body + "\nbool inputs:enableColorTemperature = 1").color
    np.testing.assert_allclose(warm, [1, 0.5, 0.25] * temperature_color(3000))
    assert warm[0] / 1 > warm[1] / 0.5 > warm[2] / 0.25, "3000 K is warm"


# Shaping


@pytest.mark.parametrize("api", ["", "ShapingAPI"])
def test_shaping_counts_whether_or_not_its_api_is_applied(api: str) -> None:
    body = """float inputs:shaping:focus = 2
        color3f inputs:shaping:focusTint = (0, 0.5, 1)
        float inputs:shaping:cone:angle = 30
        float inputs:shaping:cone:softness = 0.25"""
    assert light("SphereLight", body, api).shaping == Shaping(2, (0, 0.5, 1), 30, 0.25)
    assert light("SphereLight", "float inputs:shaping:focus = 2", api).shaping == Shaping(2)


def test_shaping_has_the_schemas_defaults_and_ranges() -> None:
    assert light("DiskLight", api="ShapingAPI").shaping == Shaping()
    out_of_range = "float inputs:shaping:focus = -1\nfloat inputs:shaping:cone:softness = 1.5"
    assert light("DiskLight", out_of_range, "ShapingAPI").shaping == Shaping(focus=0, cone_softness=1)


# Place and time


def test_lights_shine_along_their_minus_z() -> None:
    found = light("RectLight", 'float xformOp:rotateX = -90\nuniform token[] xformOpOrder = ["xformOp:rotateX"]')
    np.testing.assert_allclose(found.axis, [0, -1, 0], atol=1e-12)


def test_everything_of_a_light_may_vary_over_time() -> None:
    text = """def Xform "rig" {
        token visibility.timeSamples = { 0: "inherited", 20: "invisible" }
        double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (10, 0, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def SphereLight "light" {
            float inputs:intensity.timeSamples = { 0: 1, 10: 3 }
            float inputs:radius.timeSamples = { 0: 1, 10: 2 }
        }
    }"""
    reader = StageReader(stage_of(CUBE + text))
    (middle,) = reader.read(5).lights
    assert isinstance(middle, SphereLight)
    assert (middle.position.tolist(), middle.intensity, middle.radius) == ([5, 0, 0], 2.0, 1.5)
    assert [found.path for found in reader.read(20).lights] == [CAMERA_LIGHT]


def test_invisible_lights_are_off_and_purposes_do_not_matter() -> None:
    text = """def SphereLight "off" {
        token visibility = "invisible"
    }
    def SphereLight "guide" {
        uniform token purpose = "guide"
    }"""
    assert [found.path for found in read(text).lights] == ["/guide"]


# What is left out


def test_a_shape_that_glows_has_sizes_of_its_own() -> None:
    scene = read('def Sphere "light" (prepend apiSchemas = ["LightAPI"]) {\ndouble radius = 2\n}')
    assert reasons(scene, "/light") == []


def test_other_kinds_are_reported() -> None:
    scene = read('def PluginLight "light" {\n}\ndef SphereLight "bulb" {\n}')
    assert [found.path for found in scene.lights] == ["/bulb"]
    assert reasons(scene, "/light") == ["lights of type PluginLight are not supported yet"]


def test_portals_are_hints() -> None:
    scene = read('def DomeLight "sky" {\ndef PortalLight "window" {\n}\n}')
    assert ([found.path for found in scene.lights], scene.portals) == (["/sky"], ("/sky/window",))
    assert reasons(scene, "/sky/window") == []
    plan = make_plan(scene, RenderSettings())
    assert [d.choice for d in plan.decisions if d.subject == "portals"] == ["passed over"]


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("rel light:filters = </cube>", "light filters are ignored"),
        ("asset inputs:texture:file = @sky.png@", "the texture sky.png is ignored: there is no such file"),
        ("asset inputs:shaping:ies:file = @lamp.ies@", "the profile lamp.ies is ignored: there is no such file"),
        (
            "float intensity = 30\ncolor3f color = (1, 0, 0)\ncolor3f inputs:color = (0, 1, 0)",
            "not read, since they lack the inputs: that they have since USD 21.02: intensity",
        ),
        ("color3f inputs:color.connect = </shader.outputs:rgb>", "connections are ignored: inputs:color"),
    ],
)
def test_what_a_light_cannot_do_yet_is_reported_beside_it(body: str, reason: str) -> None:
    text = f'def RectLight "light" (prepend apiSchemas = ["ShapingAPI"]) {{\n{body}\n}}'
    scene = read(text)
    assert reasons(scene, "/light") == [reason]
    assert [found.path for found in scene.lights] == ["/light"]


# A stage without light


def test_without_light_one_shines_from_the_camera(caplog: pytest.LogCaptureFixture) -> None:
    text = """def PortalLight "window" {
    }
    def Camera "cam" {
        float xformOp:rotateY = 90
        uniform token[] xformOpOrder = ["xformOp:rotateY"]
    }"""
    with caplog.at_level(logging.INFO, "defshade"):
        (found,) = read(text).lights
    assert isinstance(found, DistantLight)
    assert found.path == CAMERA_LIGHT
    np.testing.assert_allclose(found.axis, [-1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(found.irradiance / math.pi, 1, err_msg="a white Lambertian surface facing it reads 1")
    assert "shines from the camera" in caplog.text
