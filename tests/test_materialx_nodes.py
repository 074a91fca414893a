"""MaterialX nodes that adjust and blend colours, by the formulas of its specification."""

from __future__ import annotations

import colorsys
from pathlib import Path

import numpy as np
import pytest

from defshade_cli.scene.material import UNBOUND
from test_materialx import GLTF, PREVIEW, STANDARD, WOOD, node, read, scene_of, shaded

RED = (0.5, 0.2, 0.1)
GRAY = float(np.dot(RED, (0.2722287, 0.6740818, 0.0536895)))


@pytest.mark.parametrize(
    ("identifier", "inputs", "color"),
    [
        ("ND_luminance_color3", f"color3f inputs:in = {RED}", (GRAY,) * 3),
        ("ND_luminance_color3", f"color3f inputs:in = {RED}\ncolor3f inputs:lumacoeffs = (0, 1, 0)", (0.2,) * 3),
        ("ND_saturate_color3", f"color3f inputs:in = {RED}\nfloat inputs:amount = 0", (GRAY,) * 3),
        ("ND_saturate_color3", f"color3f inputs:in = {RED}", RED),
        ("ND_contrast_color3FA", f"color3f inputs:in = {RED}\nfloat inputs:amount = 0.5", (0.5, 0.35, 0.3)),
        ("ND_smoothstep_color3FA", f"color3f inputs:in = {RED}\nfloat inputs:high = 0.4", (1, 0.5, 0.15625)),
        ("ND_hsvtorgb_color3", "color3f inputs:in = (0.4, 0.7, 0.9)", colorsys.hsv_to_rgb(0.4, 0.7, 0.9)),
        ("ND_hsvtorgb_color3", "color3f inputs:in = (-0.1, 0.7, 0.9)", colorsys.hsv_to_rgb(0.9, 0.7, 0.9)),
        ("ND_hsvtorgb_color3", "float inputs:in = 0.5", colorsys.hsv_to_rgb(0.5, 0.5, 0.5)),
        ("ND_rgbtohsv_color3", f"color3f inputs:in = {RED}", colorsys.rgb_to_hsv(*RED)),
        ("ND_rgbtohsv_color3", "color3f inputs:in = (0.2, 0.1, 0.5)", colorsys.rgb_to_hsv(0.2, 0.1, 0.5)),
        ("ND_rgbtohsv_color3", "color3f inputs:in = (0.2, 0.2, 0.2)", (0, 0, 0.2)),
        ("ND_plus_color3", f"color3f inputs:bg = {RED}\ncolor3f inputs:fg = (0.2, 0.2, 0.2)", (0.7, 0.4, 0.3)),
        ("ND_minus_color3", f"color3f inputs:bg = {RED}\ncolor3f inputs:fg = (0.1, 0.1, 0.1)", (0.4, 0.1, 0.0)),
        (
            "ND_screen_color3",
            f"color3f inputs:bg = {RED}\ncolor3f inputs:fg = (0.5, 0.5, 0.5)\nfloat inputs:mix = 0.5",
            (0.625, 0.4, 0.325),
        ),
    ],
)
def test_constants_are_adjusted_and_blended(
    tmp_path: Path, identifier: str, inputs: str, color: tuple[float, ...]
) -> None:
    base = "color3f inputs:base_color.connect = </m/made.outputs:out>"
    found, lost = read(tmp_path, GLTF, base, node("made", identifier, inputs))
    np.testing.assert_allclose(found.diffuse_color, color, atol=1e-6)
    assert lost == []


@pytest.mark.parametrize(
    ("identifier", "inputs", "scale", "bias"),
    [
        ("ND_contrast_color3FA", "float inputs:amount = 2\nfloat inputs:pivot = 0.25", 2, -0.25),
        ("ND_screen_color3", "color3f inputs:fg = (0.5, 0.5, 0.5)", 0.5, 0.5),
        ("ND_plus_color3", "color3f inputs:fg = (1, 1, 1)\nfloat inputs:mix = 0.5", 1, 0.5),
    ],
)
def test_images_too_where_a_scale_and_a_bias_say_it(
    tmp_path: Path, identifier: str, inputs: str, scale: float, bias: float
) -> None:
    source = "in" if "contrast" in identifier else "bg"
    image = f"color3f inputs:{source}.connect = </m/wood.outputs:out>\n"
    base = "color3f inputs:base_color.connect = </m/made.outputs:out>"
    found, lost = read(tmp_path, GLTF, base, WOOD + node("made", identifier, image + inputs))
    read_as = found.inputs["diffuse_color"]
    np.testing.assert_allclose((read_as.scale[:3], read_as.bias[:3]), ((scale,) * 3, (bias,) * 3), atol=1e-6)
    assert lost == []


def test_an_unlit_surface_shines_and_reflects_nothing(tmp_path: Path) -> None:
    inputs = "float inputs:emission = 2\ncolor3f inputs:emission_color = (0.1, 0.2, 0.3)\nfloat inputs:opacity = 0.5"
    found, lost = read(tmp_path, "ND_surface_unlit", inputs)
    assert (found.diffuse_color, found.metallic, found.opacity, lost) == ((0, 0, 0), 1.0, 0.5, [])
    np.testing.assert_allclose(found.emissive_color, (0.2, 0.4, 0.6), rtol=1e-6)


def test_a_surface_of_reality_composer_is_a_preview_surface(tmp_path: Path) -> None:
    inputs = """color3f inputs:baseColor = (0.1, 0.2, 0.3)
        float inputs:roughness = 0.25
        float inputs:clearcoat = 0.5
        float inputs:specular = 0.9
        vector3f inputs:normal.connect = </m/made.outputs:out>"""
    image = "asset inputs:file = @wood.png@\n"
    nodes = node("read", "ND_image_vector3", image, "vector3f outputs:out")
    nodes += node("made", "ND_normal_map_decode", "vector3f inputs:in.connect = </m/read.outputs:out>")
    found, lost = read(tmp_path, "ND_realitykit_pbr_surfaceshader", inputs, nodes)
    assert (found.roughness, found.clearcoat, found.metallic) == (0.25, 0.5, 0.0)
    np.testing.assert_allclose(found.diffuse_color, (0.1, 0.2, 0.3), rtol=1e-6)
    normal = found.inputs["normal"]
    assert (normal.scale[:3], normal.bias[:3]) == ((2, 2, 2), (-1, -1, -1))
    assert lost == ["lost of ND_realitykit_pbr_surfaceshader: specular"]


@pytest.mark.parametrize(("said", "space"), [("sRGB", "sRGB"), ("raw", "raw"), ("auto", "auto"), ("", "raw")])
def test_a_uv_texture_may_state_its_space_as_outside_materialx(tmp_path: Path, said: str, space: str) -> None:
    stated = f'string inputs:sourceColorSpace = "{said}"' if said else ""
    inputs = f"asset inputs:file = @wood.png@\n{stated}"
    image = node("made", "ND_UsdUVTexture_23", inputs, "color3f outputs:rgb")
    found, _ = read(tmp_path, GLTF, "color3f inputs:base_color.connect = </m/made.outputs:rgb>", image)
    assert found.inputs["diffuse_color"].texture.color_space == space


def test_a_materialx_surface_that_is_not_understood_is_named(tmp_path: Path) -> None:
    _, lost = read(tmp_path, "ND_disney_principled")
    assert lost == ["surface ND_disney_principled is not UsdPreviewSurface"]


@pytest.mark.parametrize(
    ("reader", "inputs"),
    [
        ("ND_geompropvalue_float", 'string inputs:geomprop = "worn"\nfloat inputs:default = 0.25'),
        ("ND_UsdPrimvarReader_float", 'string inputs:varname = "worn"\nfloat inputs:fallback = 0.25'),
    ],
)
@pytest.mark.parametrize(
    ("model", "name"), [(GLTF, "roughness"), (STANDARD, "specular_roughness"), (PREVIEW, "roughness")]
)
def test_numbers_come_from_primvars(tmp_path: Path, reader: str, inputs: str, model: str, name: str) -> None:
    made = node("made", reader, inputs, "float outputs:out")
    rough = f"float inputs:{name}.connect = </m/made.outputs:out>"
    found, lost = read(tmp_path, model, rough, made)
    assert (found.roughness, lost) == (0.25, [])
    worn = scene_of(tmp_path, shaded(model, rough, made), "float primvars:worn = 0.75")
    assert (worn.materials[0].roughness, worn.unsupported) == (0.75, ())


def test_a_colour_from_a_primvar_has_the_nodes_default(tmp_path: Path) -> None:
    inputs = 'string inputs:geomprop = "worn"\ncolor3f inputs:default = (0.25, 0.5, 1)'
    base = "color3f inputs:base_color.connect = </m/made.outputs:out>"
    found, _ = read(tmp_path, GLTF, base, node("made", "ND_geompropvalue_color3", inputs))
    assert (found.color_primvar, found.diffuse_color) == ("worn", (0.25, 0.5, 1))


@pytest.mark.parametrize("default", ['string inputs:default = "much"', "float[] inputs:default = []"])
def test_a_default_that_is_no_number_counts_as_none(tmp_path: Path, default: str) -> None:
    made = node("made", "ND_geompropvalue_float", f'string inputs:geomprop = "worn"\n{default}', "float outputs:out")
    fed = "\n".join(f"float inputs:{name}.connect = </m/made.outputs:out>" for name in ("roughness", "base_color"))
    found, lost = read(tmp_path, GLTF, fed, made)
    assert (found.roughness, found.diffuse_color, lost) == (1.0, UNBOUND.diffuse_color, [])
