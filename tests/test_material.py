"""Which material is bound, and what UsdShade networks become."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from defshade_cli.scene.material import UNBOUND, Material
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.texture import ImageFile, Texture, TextureInput
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.reader import StageReader
from stages import material_names, reasons, stage_of

BINDS = '(prepend apiSchemas = ["MaterialBindingAPI"])'


def surface(name: str, inputs: str = "", more: str = "") -> str:
    """A material with a UsdPreviewSurface; `more` stands beside the shader."""
    return f"""def Material "{name}" {{
        token outputs:surface.connect = </{name}/surface.outputs:surface>
        def Shader "surface" {{
            uniform token info:id = "UsdPreviewSurface"
            {inputs}
            token outputs:surface
        }}
        {more}
    }}
    """


def foreign(name: str, context: str) -> str:
    """A material for one renderer alone."""
    return f"""def Material "{name}" {{
        token outputs:{context}:surface.connect = </{name}/surface.outputs:out>
        def Shader "surface" {{
            token outputs:out
        }}
    }}
    """


def read(text: str, frame: float | None = None) -> Scene:
    return StageReader(stage_of(text)).read(frame)


def of_cube(materials: str, frame: float | None = None) -> Material:
    """What a cube with the material at /m is drawn with."""
    scene = read(f'{materials}\ndef Cube "cube" {BINDS} {{\nrel material:binding = </m>\n}}', frame)
    (drawable,) = scene.drawables
    return scene.materials[drawable.subsets[0].material]


def issues(materials: str) -> list[str]:
    return reasons(read(f'{materials}\ndef Cube "cube" {BINDS} {{\nrel material:binding = </m>\n}}'), "/m")


# The surface


def test_nothing_authored_is_the_schemas_surface() -> None:
    assert of_cube(surface("m")) == Material("/m")


def test_every_input_is_read() -> None:
    inputs = """color3f inputs:diffuseColor = (0.1, 0.2, 0.3)
        color3f inputs:emissiveColor = (1, 2, 3)
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0.4, 0.5, 0.6)
        float inputs:metallic = 0.25
        float inputs:roughness = 0.75
        float inputs:clearcoat = 0.5
        float inputs:clearcoatRoughness = 0.125
        float inputs:opacity = 0.5
        float inputs:opacityThreshold = 0.25
        token inputs:opacityMode = "presence"
        float inputs:ior = 1.25"""
    found = of_cube(surface("m", inputs))
    np.testing.assert_allclose(found.diffuse_color, (0.1, 0.2, 0.3), rtol=1e-6)
    np.testing.assert_allclose(found.specular_color, (0.4, 0.5, 0.6), rtol=1e-6)
    assert found.emissive_color == (1, 2, 3)
    assert found.use_specular_workflow is True
    assert (found.metallic, found.roughness, found.clearcoat, found.clearcoat_roughness) == (0.25, 0.75, 0.5, 0.125)
    assert (found.opacity, found.opacity_threshold, found.opacity_mode, found.ior) == (0.5, 0.25, "presence", 1.25)
    assert found.uses_display_color is False


def test_inputs_connect_through_interfaces() -> None:
    text = """def Material "m" {
        color3f inputs:tint = (1, 0, 0)
        float inputs:unset
        token outputs:surface.connect = </m/graph.outputs:surface>
        def NodeGraph "graph" {
            color3f inputs:tint.connect = </m.inputs:tint>
            token outputs:surface.connect = </m/graph/surface.outputs:surface>
            def Shader "surface" {
                uniform token info:id = "UsdPreviewSurface"
                color3f inputs:diffuseColor.connect = </m/graph.inputs:tint>
                float inputs:roughness.connect = </m.inputs:unset>
                token outputs:surface
            }
        }
    }"""
    assert of_cube(text) == Material("/m", diffuse_color=(1, 0, 0))
    assert issues(text) == []


def test_inputs_vary_over_time() -> None:
    stage = stage_of(
        surface("m", "float inputs:roughness.timeSamples = { 0: 0, 10: 1 }")
        + f'def Cube "cube" {BINDS} {{\nrel material:binding = </m>\n}}'
    )
    reader = StageReader(stage)
    assert [reader.read(frame).materials[0].roughness for frame in (0, 5, 10)] == [0.0, 0.5, 1.0]


def test_values_of_another_type_are_converted_or_reported() -> None:
    assert of_cube(surface("m", "float inputs:diffuseColor = 0.5")).diffuse_color == (0.5, 0.5, 0.5)
    assert of_cube(surface("m", "double inputs:roughness = 0.25")).roughness == 0.25
    assert issues(surface("m", 'string inputs:roughness = "shiny"')) == ["without roughness (str)"]


# What computes an input

READER = """def Shader "reader" {{
    uniform token info:id = "UsdPrimvarReader_{type}"
    string inputs:varname = "{name}"
    {fallback}
    {type} outputs:result
}}"""
DIFFUSE_FROM_READER = "color3f inputs:diffuseColor.connect = </m/reader.outputs:result>"
TEXTURE = """def Shader "image" {{
    uniform token info:id = "UsdUVTexture"
    asset inputs:file = @wood.png@
    {fallback}
    float3 outputs:rgb
    float outputs:g
}}"""
FROM_TEXTURE = """color3f inputs:diffuseColor.connect = </m/image.outputs:rgb>
    float inputs:roughness.connect = </m/image.outputs:g>"""


def test_a_reader_of_display_color_is_understood() -> None:
    text = surface("m", DIFFUSE_FROM_READER, READER.format(type="float3", name="displayColor", fallback=""))
    assert of_cube(text).uses_display_color
    assert issues(text) == []


def test_a_reader_of_another_primvar_falls_back() -> None:
    fallback = "float3 inputs:fallback = (1, 0, 0)"
    text = surface("m", DIFFUSE_FROM_READER, READER.format(type="float3", name="paint", fallback=fallback))
    assert of_cube(text) == Material("/m", (1, 0, 0), uses_display_color=True, color_primvar="paint")
    assert issues(text) == []
    assert colors_of(text, "") == [[1, 0, 0]]


def colors_of(material: str, primvars: str) -> list[list[float]]:
    """What a cube with `primvars` is drawn in."""
    scene = read(f'{material}\ndef Cube "cube" {BINDS} {{\n{primvars}\nrel material:binding = </m>\n}}')
    return scene.drawables[0].display_color.tolist()


def test_any_primvar_can_be_the_colour_also_through_an_interface() -> None:
    reader = READER.format(type="float3", name="unused", fallback="").replace(
        'string inputs:varname = "unused"', "string inputs:varname.connect = </m.inputs:set>"
    )
    text = surface("m", DIFFUSE_FROM_READER, reader).replace("{", '{\nstring inputs:set = "paint"', 1)
    primvars = """color3f[] primvars:paint = [(0, 1, 0)]
        color3f[] primvars:displayColor = [(0, 0, 1)]"""
    assert colors_of(text, primvars) == [[0, 1, 0]]
    assert issues(text) == []


def test_a_colour_primvar_may_vary_over_the_mesh() -> None:
    reader = READER.format(type="float3", name="paint", fallback="")
    mesh = f"""def Mesh "mesh" {BINDS} {{
        uniform token subdivisionScheme = "none"
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
        color3f[] primvars:paint = [(1, 0, 0), (0, 1, 0), (0, 0, 1)] (interpolation = "vertex")
        rel material:binding = </m>
    }}"""
    (drawn,) = read(surface("m", DIFFUSE_FROM_READER, reader) + mesh).meshes
    assert drawn.display_color is not None
    np.testing.assert_array_equal(drawn.display_color, np.eye(3))


def test_display_color_leaves_the_opacity_alone() -> None:
    reader = READER.format(type="float3", name="displayColor", fallback="")
    found = of_cube(surface("m", f"{DIFFUSE_FROM_READER}\nfloat inputs:opacity = 0.5", reader))
    assert (found.uses_display_color, found.uses_display_opacity, found.opacity) == (True, False, 0.5)


def test_a_texture_falls_back_channel_by_channel() -> None:
    text = surface("m", FROM_TEXTURE, TEXTURE.format(fallback="float4 inputs:fallback = (1, 0.25, 0, 1)"))
    assert of_cube(text) == Material("/m", diffuse_color=(1, 0.25, 0), roughness=0.25)
    assert issues(text) == ["without diffuseColor (no file wood.png), roughness (no file wood.png)"]


def test_a_texture_without_fallback_leaves_the_schemas_default() -> None:
    assert of_cube(surface("m", FROM_TEXTURE, TEXTURE.format(fallback=""))) == Material("/m")


def test_a_material_is_reported_once() -> None:
    cubes = "".join(f'def Cube "c{i}" {BINDS} {{\nrel material:binding = </m>\n}}\n' for i in range(3))
    assert len(reasons(read(surface("m", FROM_TEXTURE, TEXTURE.format(fallback="")) + cubes), "/m")) == 1


COORDINATES = """def Shader "turn" {
    uniform token info:id = "UsdTransform2d"
    float2 inputs:in.connect = </m/coordinates.outputs:result>
    float inputs:rotation = 90
    float2 inputs:scale = (2, 3)
    float2 inputs:translation = (4, 5)
    float2 outputs:result
}
def Shader "coordinates" {
    uniform token info:id = "UsdPrimvarReader_float2"
    string inputs:varname.connect = </m.inputs:set>
    float2 outputs:result
}"""


def network(folder: Path, file: str, more: str = "") -> str:
    """A stage in `folder` whose cube reads its colour and roughness from `file`."""
    image = TEXTURE.format(fallback=more).replace("wood.png", file)
    image = image.replace(
        "float3 outputs:rgb", "float2 inputs:st.connect = </m/turn.outputs:result>\nfloat3 outputs:rgb"
    )
    material = surface("m", FROM_TEXTURE, f"{image}\n{COORDINATES}").replace("{", '{\nstring inputs:set = "map"', 1)
    stage = folder / "stage.usda"
    stage.write_text(f'#usda 1.0\n{material}\ndef Cube "cube" {BINDS} {{\nrel material:binding = </m>\n}}')
    return str(stage)


def read_inputs(stage: str) -> Mapping[str, TextureInput]:
    scene = StageReader(open_stage(Path(stage))).read(None)
    assert scene.unsupported == ()
    return scene.materials[0].inputs


def test_a_texture_with_its_coordinates_is_read(tmp_path: Path) -> None:
    (tmp_path / "wood.png").touch()
    options = """token inputs:wrapS = "mirror"
    token inputs:sourceColorSpace = "raw"
    float4 inputs:scale = (2, 2, 2, 1)
    float4 inputs:bias = (-1, -1, -1, 0)"""
    inputs = read_inputs(network(tmp_path, "wood.png", options))
    color, roughness = inputs["diffuse_color"], inputs["roughness"]
    file = ImageFile(str(tmp_path / "wood.png"))
    assert color.texture == Texture(((1001, file),), color_space="raw", wrap_s="mirror", wrap_t="useMetadata")
    assert (color.channel, roughness.channel, color.uv) == ("rgb", "g", "map")
    assert (color.scale, color.bias) == ((2, 2, 2, 1), (-1, -1, -1, 0))
    np.testing.assert_allclose(color.texture_from_uv, [[0, -3, 4], [2, 0, 5]], atol=1e-12)


def test_coordinates_in_a_circle_are_reported(tmp_path: Path) -> None:
    (tmp_path / "wood.png").touch()
    stage = network(tmp_path, "wood.png")
    text = Path(stage).read_text().replace("</m/coordinates.outputs:result>", "</m/turn.outputs:result>")
    Path(stage).write_text(text)
    scene = StageReader(open_stage(Path(stage))).read(None)
    assert "run in a circle" in scene.unsupported[0].reason


def test_back_slashes_and_udim_sets_are_resolved(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    for name in ("wood.png", "tile.1001.png", "tile.1012.png"):
        (tmp_path / "maps" / name).touch()
    slashed = read_inputs(network(tmp_path, r"maps\wood.png"))["diffuse_color"].texture
    assert Path(slashed.tiles[0][1].path) == tmp_path / "maps" / "wood.png"
    tiles = read_inputs(network(tmp_path, "maps/tile.<UDIM>.png"))["diffuse_color"].texture
    assert tiles.udim
    assert [number for number, _ in tiles.tiles] == [1001, 1012]


def test_occlusion_is_nothing_to_report() -> None:
    text = surface("m", "float inputs:occlusion.connect = </m/image.outputs:g>", TEXTURE.format(fallback=""))
    assert issues(text) == []


@pytest.mark.parametrize(
    ("material", "reason"),
    [
        ('def Material "m" {\n}', "no surface"),
        ("", "the bound material does not exist"),
        (
            foreign("m", "mtlx"),
            "no UsdPreviewSurface, only mtlx:surface",
        ),
        (
            surface("m").replace("UsdPreviewSurface", "ND_disney_principled"),
            "surface ND_disney_principled is not UsdPreviewSurface",
        ),
        (
            surface("m").replace('info:id = "UsdPreviewSurface"', 'info:implementationSource = "sourceAsset"'),
            "surface shader of source code is not UsdPreviewSurface",
        ),
    ],
)
def test_what_is_not_understood_is_reported_and_drawn_as_unbound(material: str, reason: str) -> None:
    assert of_cube(material) == replace(UNBOUND, path="/m")
    assert issues(material) == [reason]


# Binding


def test_an_unbound_prim_has_the_unbound_material() -> None:
    scene = read('def Cube "cube" {\n}')
    assert scene.materials == (UNBOUND,)
    assert scene.unsupported == ()


ALL = surface("m") + surface("full") + surface("preview") + surface("other")
FOREIGN = foreign("foreign", "ri")


@pytest.mark.parametrize(
    ("bindings", "bound"),
    [
        ({"": "m"}, "m"),
        ({"": "m", ":preview": "preview"}, "preview"),
        ({"": "m", ":preview": "preview", ":full": "full"}, "full"),
        ({"": "m", ":full": "foreign"}, "m"),
        ({"": "foreign", ":preview": "preview"}, "preview"),
        ({"": "m", ":preview": "preview", ":full": "foreign"}, "preview"),
        ({":full": "foreign"}, "foreign"),
    ],
)
def test_the_first_purpose_that_is_understood_is_drawn(bindings: dict[str, str], bound: str) -> None:
    body = "\n".join(f"rel material:binding{purpose} = </{name}>" for purpose, name in bindings.items())
    scene = read(f'{ALL}{FOREIGN}def Cube "cube" {BINDS} {{\n{body}\n}}')
    assert material_names(scene, "/cube") == [f"/{bound}"]
    assert bool(reasons(scene, "/foreign")) == (bound == "foreign"), "what is not drawn is not reported"


@pytest.mark.parametrize(("strength", "bound"), [("weakerThanDescendants", "other"), ("strongerThanDescendants", "m")])
def test_strength_decides_between_ancestors(strength: str, bound: str) -> None:
    text = f"""def Xform "group" {BINDS} {{
        rel material:binding = </m> (bindMaterialAs = "{strength}")
        def Cube "cube" {BINDS} {{
            rel material:binding = </other>
        }}
        def Cube "plain" {{
        }}
    }}"""
    scene = read(ALL + text)
    assert material_names(scene, "/group/cube") == [f"/{bound}"]
    assert material_names(scene, "/group/plain") == ["/m"]


def test_collections_bind_their_members() -> None:
    text = """def Xform "group" (prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:some"]) {
        uniform token collection:some:expansionRule = "expandPrims"
        rel collection:some:includes = </group/a>
        rel material:binding = </m>
        rel material:binding:collection:some = [</group.collection:some>, </other>]
        def Cube "a" {
        }
        def Cube "b" {
        }
    }"""
    scene = read(ALL + text)
    assert material_names(scene, "/group/a") == ["/other"]
    assert material_names(scene, "/group/b") == ["/m"]


def test_subsets_have_materials_of_their_own() -> None:
    text = f"""def Mesh "mesh" {BINDS} {{
        uniform token subdivisionScheme = "none"
        int[] faceVertexCounts = [3, 3, 3]
        int[] faceVertexIndices = [0, 1, 2, 0, 2, 3, 0, 3, 4]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (-1, 0, 0)]
        rel material:binding = </m>
        def GeomSubset "part" {BINDS} {{
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            int[] indices = [1]
            rel material:binding = </other>
        }}
    }}"""
    scene = read(ALL + text)
    assert material_names(scene, "/mesh") == ["/m", "/other"]
    (drawable,) = scene.drawables
    assert [(subset.first, subset.count) for subset in drawable.subsets] == [(0, 2), (2, 1)]
    assert scene.meshes[0].faces.tolist() == [0, 2, 1]


def test_equal_bindings_share_one_material() -> None:
    cubes = "".join(f'def Cube "c{i}" {BINDS} {{\nrel material:binding = </m>\n}}\n' for i in range(3))
    scene = read(ALL + cubes)
    assert [material.path for material in scene.materials] == ["/m"]
