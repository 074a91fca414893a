"""MaterialX: what its networks fold into, and what its shading models become."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.texture import TextureInput
from defshade_cli.usd.materials.materialx.models import MODELS
from defshade_cli.usd.materials.materialx.signal import Lookup, NonLinear, Signal, constant, joined, mixed, texel
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.reader import StageReader

BINDS = '(prepend apiSchemas = ["MaterialBindingAPI"])'
STANDARD = "ND_standard_surface_surfaceshader"
OPEN_PBR = "ND_open_pbr_surface_surfaceshader"
GLTF = "ND_gltf_pbr_surfaceshader"
PREVIEW = "ND_UsdPreviewSurface_surfaceshader"


def scene_of(folder: Path, text: str, body: str = "") -> Scene:
    """A cube with the material </m>, in a folder that has an image."""
    (folder / "wood.png").touch()
    stage = folder / "stage.usda"
    stage.write_text(f'#usda 1.0\n{text}\ndef Cube "cube" {BINDS} {{\nrel material:binding = </m>\n{body}\n}}')
    return StageReader(open_stage(stage)).read(None)


def shaded(model: str, inputs: str = "", nodes: str = "", output: str = "outputs:mtlx:surface") -> str:
    return f"""def Material "m" {{
        token {output}.connect = </m/surface.outputs:out>
        def Shader "surface" {{
            uniform token info:id = "{model}"
            {inputs}
            token outputs:out
        }}
        {nodes}
    }}"""


def node(name: str, identifier: str, inputs: str, output: str = "color3f outputs:out") -> str:
    return f"""def Shader "{name}" {{
        uniform token info:id = "{identifier}"
        {inputs}
        {output}
    }}
    """


def read(folder: Path, *arguments: str) -> tuple[Material, list[str]]:
    """The material, and what was lost of it."""
    scene = scene_of(folder, shaded(*arguments))
    return scene.materials[0], [issue.reason for issue in scene.unsupported]


WOOD = node("wood", "ND_image_color3", 'asset inputs:file = @wood.png@ (colorSpace = "srgb_texture")')
COLOR = "color3f inputs:base_color.connect = </m/{}.outputs:out>"
ROUGHNESS = "float inputs:specular_roughness.connect = </m/{}.outputs:out>"


# Signals

VALUES = st.lists(st.floats(-4, 4), min_size=3, max_size=3).map(np.array)
IMAGE = Lookup.__new__(Lookup, None, "st")  # type: ignore[arg-type]


def evaluated(signal: Signal, at: np.ndarray) -> np.ndarray:
    """By its own definition."""
    return at[list(signal.sources)] * signal.scale + signal.bias


@given(VALUES, VALUES, VALUES, VALUES)
def test_arithmetic_of_signals_is_arithmetic_of_their_values(
    at: np.ndarray, factor: np.ndarray, shift: np.ndarray, amount: np.ndarray
) -> None:
    image, a, b, m = texel(IMAGE, 3), constant(factor), constant(shift), constant(amount)
    expected = {
        image * a + b: at * factor + shift,
        b - image * a: shift - at * factor,
        mixed(image, a, m): at * (1 - amount) + factor * amount,
        image + image: at + at,
        (image * a).pick([2, 0]): (at * factor)[[2, 0]],
        joined([image.pick([1]), constant(0.5), image.pick([0])]): np.array([at[1], 0.5, at[0]]),
    }
    for signal, values in expected.items():
        np.testing.assert_allclose(evaluated(signal, at), values, atol=1e-12)


def test_what_is_not_linear_in_one_texel_is_refused() -> None:
    image, other = texel(IMAGE, 3), texel(Lookup(None, "uv2"), 3)  # type: ignore[arg-type]
    for operation in (lambda: image * image, lambda: image + other, lambda: constant(1.0) / image):
        with pytest.raises(NonLinear):
            operation()
    with pytest.raises(NonLinear):
        joined([image, other])
    assert (image * constant(0.0)).is_constant


# Networks


def test_a_tinted_image_is_scale_and_bias(tmp_path: Path) -> None:
    nodes = WOOD + node(
        "tint",
        "ND_multiply_color3",
        "color3f inputs:in1.connect = </m/wood.outputs:out>\ncolor3f inputs:in2 = (1, 0.5, 0)",
    )
    found, lost = read(tmp_path, STANDARD, COLOR.format("tint") + "\nfloat inputs:base = 0.5", nodes)
    color = found.inputs["diffuse_color"]
    assert lost == []
    assert (color.channel, color.scale, color.bias, color.uv) == ("rgb", (0.5, 0.25, 0, 1), (0, 0, 0, 1), "st")
    assert (color.texture.color_space, color.texture.wrap_s) == ("sRGB", "repeat")


@pytest.mark.parametrize(
    ("name", "space"),
    [
        ("acescg", "lin_ap1_scene"),
        ("adobergb", "g22_adobergb_scene"),
        ("lin_rec2020_scene", "lin_rec2020_scene"),
        ("gamma18", "g18_rec709_scene"),
        ("srgb_rec709_scene", "sRGB"),
        ("lin_rec709", "raw"),
        ("none", "raw"),
    ],
)
def test_images_keep_their_colour_space(tmp_path: Path, name: str, space: str) -> None:
    wood = WOOD.replace("srgb_texture", name)
    found, lost = read(tmp_path, STANDARD, COLOR.format("wood"), wood)
    assert (found.inputs["diffuse_color"].texture.color_space, lost) == (space, [])


def test_constants_are_converted_and_unknown_spaces_named(tmp_path: Path) -> None:
    """ACEScg's red by the matrix of the ACES project, (1.705, −0.130, −0.024); colours are no less than 0."""
    red = 'color3f inputs:emission_color = (1, 0, 0) (colorSpace = "{}")\nfloat inputs:emission = 1'
    for name in ("acescg", "lin_ap1_scene"):
        found, lost = read(tmp_path, STANDARD, red.format(name))
        np.testing.assert_allclose(np.maximum(found.emissive_color, 0.0), (1.7050504, 0, 0), atol=1e-4)
        assert lost == []
    found, lost = read(tmp_path, STANDARD, red.format("lin_nowhere"))
    np.testing.assert_allclose(found.emissive_color, (1, 0, 0))
    assert any("colour space lin_nowhere" in reason for reason in lost)


@pytest.mark.parametrize(
    ("identifier", "inputs", "channel", "scale", "bias"),
    [
        ("ND_extract_color3", "color3f inputs:in.connect = {}\nint inputs:index = 1", "g", 1, 0),
        ("ND_swizzle_color3_float", 'color3f inputs:in.connect = {}\nstring inputs:channels = "b"', "b", 1, 0),
        ("ND_separate3_color3", "color3f inputs:in.connect = {}", "g", 1, 0),
        ("ND_invert_float", "float inputs:in.connect = {}", "r", -1, 1),
        ("ND_add_float", "float inputs:in1.connect = {}\nfloat inputs:in2 = 0.25", "r", 1, 0.25),
        ("ND_divide_float", "float inputs:in1.connect = {}\nfloat inputs:in2 = 4", "r", 0.25, 0),
        ("ND_remap_float", "float inputs:in.connect = {}\nfloat inputs:outlow = 0.5", "r", 0.5, 0.5),
        ("ND_mix_float", "float inputs:fg.connect = {}\nfloat inputs:bg = 1\nfloat inputs:mix = 0.25", "r", 0.25, 0.75),
        ("ND_clamp_float", "float inputs:in.connect = {}", "r", 1, 0),
        ("ND_dot_float", "float inputs:in.connect = {}", "r", 1, 0),
        ("ND_ifgreater_float", "float inputs:in1.connect = {}\nfloat inputs:value1 = 2", "r", 1, 0),
    ],
)  # fmt: skip
def test_a_node_folds(tmp_path: Path, identifier: str, inputs: str, channel: str, scale: float, bias: float) -> None:
    out = "outg" if "separate" in identifier else "out"
    nodes = WOOD + node("n", identifier, inputs.format("</m/wood.outputs:out>"), f"float outputs:{out}")
    found, lost = read(tmp_path, STANDARD, f"float inputs:specular_roughness.connect = </m/n.outputs:{out}>", nodes)
    rough = found.inputs["roughness"]
    assert lost == []
    np.testing.assert_allclose((*rough.scale, *rough.bias), [scale] * 4 + [bias] * 4, atol=1e-7)
    assert rough.channel == channel


def test_a_node_that_does_not_fold_lets_its_image_through_and_is_named(tmp_path: Path) -> None:
    nodes = WOOD + node(
        "gamma", "ND_power_color3FA", "color3f inputs:in1.connect = </m/wood.outputs:out>\nfloat inputs:in2 = 2.2"
    )
    found, lost = read(tmp_path, STANDARD, COLOR.format("gamma"), nodes)
    assert found.inputs["diffuse_color"].scale == (1, 1, 1, 1)
    assert lost == [f"lost of {STANDARD}: base_color (power)"]


def test_constants_are_computed_whatever_the_node(tmp_path: Path) -> None:
    nodes = node("c", "ND_constant_float", "float inputs:value = 0.5", "float outputs:out") + node(
        "p",
        "ND_power_float",
        "float inputs:in1.connect = </m/c.outputs:out>\nfloat inputs:in2 = 2",
        "float outputs:out",
    )
    found, lost = read(tmp_path, STANDARD, ROUGHNESS.format("p"), nodes)
    assert (found.roughness, lost) == (0.25, [])


def test_a_circle_ends(tmp_path: Path) -> None:
    nodes = node("a", "ND_dot_float", "float inputs:in.connect = </m/b.outputs:out>", "float outputs:out") + node(
        "b", "ND_dot_float", "float inputs:in.connect = </m/a.outputs:out>", "float outputs:out"
    )
    found, lost = read(tmp_path, STANDARD, ROUGHNESS.format("a"), nodes)
    assert found.roughness == 0.2
    assert "circle" in lost[0]


def test_a_missing_file_takes_the_nodes_default(tmp_path: Path) -> None:
    image = WOOD.replace("wood.png", "gone.png").replace("asset", "color3f inputs:default = (1, 0, 1)\nasset")
    found, lost = read(tmp_path, STANDARD, COLOR.format("wood"), image)
    assert found.diffuse_color == (1, 0, 1) and not found.inputs
    assert lost == [f"lost of {STANDARD}: base_color (no file gone.png)"]


def test_a_normal_map_is_decoded_and_its_slope_scaled(tmp_path: Path) -> None:
    nodes = WOOD + node(
        "bump", "ND_normalmap_float", "float3 inputs:in.connect = </m/wood.outputs:out>\nfloat inputs:scale = 0.5"
    )
    found, lost = read(tmp_path, OPEN_PBR, "float3 inputs:geometry_normal.connect = </m/bump.outputs:out>", nodes)
    assert (found.inputs["normal"].scale, found.inputs["normal"].bias) == ((1, 1, 2, 1), (-0.5, -0.5, -1, 1))
    assert lost == []


def test_display_color_is_read(tmp_path: Path) -> None:
    nodes = node("paint", "ND_geompropvalue_color3", 'string inputs:geomprop = "displayColor"')
    found, lost = read(tmp_path, STANDARD, COLOR.format("paint"), nodes)
    assert found.uses_display_color and lost == []


# Coordinates


def placed_by(folder: Path, nodes: str, model: str = STANDARD) -> TextureInput:
    image = WOOD.replace("asset", "float2 inputs:texcoord.connect = </m/place.outputs:out>\nasset")
    found, lost = read(folder, model, COLOR.format("wood"), image + nodes)
    assert lost == []
    return found.inputs["diffuse_color"]


@pytest.mark.parametrize("order", [0, 1])
def test_place2d_is_the_librarys_graph(tmp_path: Path, order: int) -> None:
    """NG_place2d_vector2 of the standard library, step by step."""
    inputs = f"""float2 inputs:pivot = (0.5, 0.25)
        float2 inputs:scale = (2, 4)
        float2 inputs:offset = (0.125, -0.5)
        float inputs:rotate = 30
        int inputs:operationorder = {order}
        float2 inputs:texcoord.connect = </m/uv.outputs:out>"""
    nodes = node("place", "ND_place2d_vector2", inputs, "float2 outputs:out")
    nodes += node("uv", "ND_geompropvalue_vector2", 'string inputs:geomprop = "map2"', "float2 outputs:out")
    found = placed_by(tmp_path, nodes)
    uv, pivot, scale, offset = map(np.array, ((0.3, 0.8), (0.5, 0.25), (2, 4), (0.125, -0.5)))
    sine, cosine = np.sin(np.radians(30)), np.cos(np.radians(30))

    def turned(v: np.ndarray) -> np.ndarray:
        return np.array([cosine * v[0] + sine * v[1], -sine * v[0] + cosine * v[1]])

    expected = turned((uv - pivot) / scale) - offset if order == 0 else turned(uv - pivot - offset) / scale
    np.testing.assert_allclose(np.array(found.texture_from_uv) @ [*uv, 1], expected + pivot)
    assert found.uv == "map2"


def test_coordinates_are_tiled_and_named(tmp_path: Path) -> None:
    nodes = node(
        "place", "ND_multiply_vector2FA", "float2 inputs:in1.connect = </m/uv.outputs:out>\nfloat inputs:in2 = 3"
    )
    nodes += node("uv", "ND_texcoord_vector2", "int inputs:index = 1", "float2 outputs:out")
    found = placed_by(tmp_path, nodes)
    assert (found.uv, found.texture_from_uv) == ("st1", ((3, 0, 0), (0, 3, 0)))


def test_coordinates_in_a_circle_end(tmp_path: Path) -> None:
    image = WOOD.replace("asset", "float2 inputs:texcoord.connect = </m/place.outputs:out>\nasset")
    circle = node("place", "ND_dot_vector2", "float2 inputs:in.connect = </m/place.outputs:out>", "float2 outputs:out")
    found, lost = read(tmp_path, STANDARD, COLOR.format("wood"), image + circle)
    assert not found.inputs and "circle" in lost[0]


# Shading models


@pytest.fixture(scope="module")
def library() -> Any:
    """MaterialX's own definitions of nodes."""
    mx = pytest.importorskip("MaterialX")
    document = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), document)
    return document


@pytest.mark.parametrize("model", [name for name in MODELS if "realitykit" not in name])  # it is Apple's own
def test_defaults_are_those_of_the_library(library: Any, model: str) -> None:
    definition = library.getNodeDef(model)
    assert definition is not None
    for name, default in MODELS[model].defaults.items():
        declared = definition.getActiveInput(name)
        assert declared is not None, name
        if declared.getValue() is not None:
            value = declared.getValue()
            np.testing.assert_allclose(default, value.asTuple() if hasattr(value, "asTuple") else value, rtol=1e-6)
    unknown = [name for name in MODELS[model].left_out if definition.getActiveInput(name) is None]
    assert unknown == []


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        (STANDARD, Material("/m", (0.8, 0.8, 0.8), roughness=0.2, clearcoat_roughness=0.1, opacity_mode="presence")),
        (OPEN_PBR, Material("/m", (0.8, 0.8, 0.8), roughness=0.3, clearcoat_roughness=0.0, opacity_mode="presence")),
        (
            GLTF,
            Material("/m", (1, 1, 1), metallic=1.0, roughness=1.0, clearcoat_roughness=0.0, opacity_mode="presence"),
        ),
        (PREVIEW, Material("/m")),
    ],
)
def test_nothing_authored_is_the_nodedefs_surface(tmp_path: Path, model: str, expected: Material) -> None:
    found, lost = read(tmp_path, model)
    assert lost == []
    assert found.ior == pytest.approx(1.5)
    for name in ("diffuse_color", "metallic", "roughness", "clearcoat", "clearcoat_roughness", "opacity_mode"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name)), name


def f0(material: Material) -> np.ndarray:
    if material.use_specular_workflow:
        return np.array(material.specular_color)
    return np.full(3, ((material.ior - 1) / (material.ior + 1)) ** 2)


@pytest.mark.parametrize(
    ("inputs", "expected", "lost"),
    [
        ("float inputs:specular = 0.5", [0.02] * 3, 0),
        ("float inputs:specular_IOR = 2", [1 / 9] * 3, 0),
        ("color3f inputs:specular_color = (1, 0.5, 0)", [0.04, 0.02, 0], 0),
        ("color3f inputs:specular_color = (1, 0.5, 0)\nfloat inputs:metalness = 0.5", [0.04] * 3, 1),
    ],
)
def test_reflections_keep_their_f0(tmp_path: Path, inputs: str, expected: list[float], lost: int) -> None:
    found, reasons = read(tmp_path, STANDARD, inputs)
    np.testing.assert_allclose(f0(found), expected, atol=1e-6)
    assert len(reasons) == lost


def test_lobes_without_counterpart_are_named_once_where_they_are_felt(tmp_path: Path) -> None:
    inputs = """float inputs:sheen = 0.5
        color3f inputs:coat_color = (1, 0, 0)
        float inputs:thin_film_thickness = 0"""
    assert read(tmp_path, STANDARD, inputs)[1] == [f"lost of {STANDARD}: sheen"]
    _, lost = read(tmp_path, STANDARD, f"{inputs}\nfloat inputs:coat = 1")
    assert lost == [f"lost of {STANDARD}: sheen, coat_color"]


def test_transmission_is_thin_and_opacity_is_presence(tmp_path: Path) -> None:
    glass, lost = read(tmp_path, STANDARD, "float inputs:transmission = 0.75")
    assert (glass.opacity, glass.opacity_mode) == (0.25, "transparent")
    assert "transmission" in lost[0]
    leaf, lost = read(tmp_path, STANDARD, "color3f inputs:opacity = (0.5, 0.5, 0.5)")
    assert (leaf.opacity, leaf.opacity_mode, lost) == (0.5, "presence", [])


@pytest.mark.parametrize(("mode", "opacity", "threshold"), [(0, 1.0, 0.0), (1, 0.25, 0.5), (2, 0.25, 0.0)])
def test_alpha_modes_of_gltf(tmp_path: Path, mode: int, opacity: float, threshold: float) -> None:
    found, lost = read(tmp_path, GLTF, f"float inputs:alpha = 0.25\nint inputs:alpha_mode = {mode}")
    assert (found.opacity, found.opacity_threshold, lost) == (opacity, threshold, [])


def test_preview_surface_says_the_same_in_both_languages(tmp_path: Path) -> None:
    inputs = """color3f inputs:diffuseColor = (0.1, 0.2, 0.3)
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0.4, 0.5, 0.6)
        float inputs:clearcoat = 0.5
        float inputs:opacity = 0.5
        {} inputs:opacityMode = {}
        float inputs:ior = 1.25"""
    native, _ = read(tmp_path, "UsdPreviewSurface", inputs.format("token", '"presence"'), "", "outputs:surface")
    translated, lost = read(tmp_path, PREVIEW, inputs.format("int", 1))
    assert (translated, lost) == (native, [])


def test_a_preview_surface_beside_it_is_preferred(tmp_path: Path) -> None:
    both = node("native", "UsdPreviewSurface", "color3f inputs:diffuseColor = (1, 0, 0)", "token outputs:out")
    text = shaded(STANDARD, "", both).replace(
        'def Material "m" {', 'def Material "m" {\ntoken outputs:surface.connect = </m/native.outputs:out>'
    )
    assert scene_of(tmp_path, text).materials[0].diffuse_color == (1, 0, 0)
