"""Colours that are authored in other spaces than linear Rec.709, and a chart through the whole chain."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from pxr import Gf, Usd

from defshade_cli import render
from defshade_cli.usd.color_space import in_rec709, texture_space
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.reader import StageReader
from stages import read, stage_of

RED_AP1 = (1.7050504, -0.1302564, -0.0240033)
"""ACEScg's red in linear Rec.709, by the matrix of the ACES project (Bradford)."""


def test_metadata_of_a_primvar() -> None:
    (drawable,) = read(
        'def Cube "c" {\ncolor3f[] primvars:displayColor = [(1, 0, 0)] ( colorSpace = "lin_ap1_scene" )\n}'
    ).drawables
    np.testing.assert_allclose(drawable.display_color, [RED_AP1], atol=1e-4)


def test_a_prim_declares_the_space_of_what_is_below() -> None:
    text = """def Xform "set" ( prepend apiSchemas = ["ColorSpaceAPI"] ) {
        uniform token colorSpace:name = "lin_ap1_scene"
        def Cube "cube" {
            rel material:binding = </set/m>
        }
        def SphereLight "light" {
            color3f inputs:color = (1, 0, 0)
        }
        def Material "m" {
            token outputs:surface.connect = </set/m/s.outputs:surface>
            def Shader "s" {
                uniform token info:id = "UsdPreviewSurface"
                color3f inputs:diffuseColor = (1, 0, 0)
                color3f inputs:emissiveColor = (0, 0, 1) ( colorSpace = "lin_rec709_scene" )
                float inputs:roughness = 0.25
                token outputs:surface
            }
        }
    }"""
    scene = read(text)
    (material,) = [material for material in scene.materials if material.path]
    np.testing.assert_allclose(material.diffuse_color, RED_AP1, atol=1e-4)
    np.testing.assert_allclose(material.emissive_color, (0, 0, 1))
    assert material.roughness == 0.25
    np.testing.assert_allclose(scene.lights[0].color, RED_AP1, atol=1e-4)


@pytest.mark.parametrize("space", ["", "lin_rec709_scene", "data", "raw", "of no such name"])
def test_what_is_no_other_space_stays_as_it_is(space: str) -> None:
    attribute = attribute_in(space)
    value = attribute.Get()
    assert in_rec709(attribute, value) is value


def attribute_in(space: str) -> Usd.Attribute:
    metadata = f'( colorSpace = "{space}" )' if space else ""
    stage = stage_of(f'def Scope "s" {{\ncolor3f c = (0.5, 0.02, 0.9) {metadata}\nasset f = @a.png@ {metadata}\n}}')
    attribute = stage.GetPrimAtPath("/s").GetAttribute("c")
    _KEPT.append(stage)
    return attribute


_KEPT: list[Usd.Stage] = []
"""An attribute does not keep its stage."""


def test_curves_are_undone_as_gf_does() -> None:
    attribute = attribute_in("srgb_rec709_scene")
    expected = Gf.ColorSpace("lin_rec709_scene").Convert(Gf.ColorSpace("srgb_rec709_scene"), attribute.Get())
    np.testing.assert_allclose(in_rec709(attribute, attribute.Get()), expected.GetRGB(), rtol=1e-6)


@pytest.mark.parametrize(
    ("space", "expected"),
    [
        ("", "auto"),
        ("raw", "raw"),
        ("lin_rec709_scene", "raw"),
        ("srgb_rec709_scene", "sRGB"),
        ("ACEScg", "lin_ap1_scene"),
        ("acescg", "lin_ap1_scene"),
        ("sRGB", "sRGB"),
        ("srgb_texture", "sRGB"),
        ("linear", "raw"),
        ("of no such name", "auto"),
    ],
)
def test_spaces_of_texture_files(space: str, expected: str) -> None:
    assert texture_space(attribute_in(space).GetPrim().GetAttribute("f")) == expected


@pytest.mark.parametrize(
    ("said", "expected", "told"),
    [("srgb_texture", "sRGB", []), ("Linear", "auto", ["without colour space Linear"]), ("", "auto", [])],
)
def test_a_node_may_say_any_space(tmp_path: Path, said: str, expected: str, told: list[str]) -> None:
    """Over what is said of its file."""
    oiio.ImageBuf(np.full((4, 4, 3), 0.5, np.float32)).write(str(tmp_path / "flat.exr"))
    textured = TEXTURED.replace('( colorSpace = "lin_ap1_scene" )', f'\ntoken inputs:sourceColorSpace = "{said}"')
    (tmp_path / "flat.usda").write_text(QUAD.replace("DIFFUSE", textured))
    scene = StageReader(open_stage(tmp_path / "flat.usda")).read(None)
    assert [texture.color_space for texture in scene.textures] == [expected]
    assert [issue.reason for issue in scene.unsupported] == told


def test_names_that_nobody_knows_are_told(tmp_path: Path) -> None:
    oiio.ImageBuf(np.full((4, 4, 3), 0.5, np.float32)).write(str(tmp_path / "flat.exr"))
    text = QUAD.replace("DIFFUSE", TEXTURED).replace("lin_ap1_scene", "of no name")
    text = text.replace("intensity = 1", 'intensity = 1\ncolor3f inputs:color = (1, 0, 0) ( colorSpace = "nowhere" )')
    (tmp_path / "flat.usda").write_text(text)
    told = {
        issue.path: issue.reason for issue in StageReader(open_stage(tmp_path / "flat.usda")).read(None).unsupported
    }
    assert told["/m"] == "without colour space of no name"
    assert told["/sun"] == "its color counts as linear Rec.709: there is no colour space nowhere"


def test_a_texture_in_another_space(tmp_path: Path) -> None:
    """An ACEScg image of one colour shows what the same colour shows as a constant."""
    color = (0.3, 0.5, 0.1)
    image = oiio.ImageBuf(np.full((4, 4, 3), color, np.float32))
    image.write(str(tmp_path / "flat.exr"))
    shown = []
    for source in (f'color3f inputs:diffuseColor = {color} ( colorSpace = "lin_ap1_scene" )', TEXTURED):
        (tmp_path / "flat.usda").write_text(QUAD.replace("DIFFUSE", source))
        shown.append(render(tmp_path / "flat.usda", size=(8, 8), shadows=False).layers["beauty"][4, 4])
    np.testing.assert_allclose(shown[1], shown[0], rtol=2e-3)  # half floats


TEXTURED = """color3f inputs:diffuseColor.connect = </m/t.outputs:rgb>
    }
    def Shader "t" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @flat.exr@ ( colorSpace = "lin_ap1_scene" )
        token inputs:wrapS = "clamp"
        token inputs:wrapT = "clamp"
        float3 outputs:rgb"""

QUAD = """#usda 1.0
( upAxis = "Y" )
def Camera "c" {
    float2 clippingRange = (0.1, 100)
    token projection = "orthographic"
    float horizontalAperture = 10
    float verticalAperture = 10
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DistantLight "sun" {
    float inputs:angle = 0
    float inputs:intensity = 1
}
def Mesh "quad" {
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    rel material:binding = </m>
}
def Material "m" {
    token outputs:surface.connect = </m/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:ior = 1
        token outputs:surface
        DIFFUSE
    }
}
"""


@pytest.mark.parametrize("space", [None, "ACEScg"])
def test_a_chart_keeps_its_published_colours(space: str | None, scenes: Path) -> None:
    """The 24 patches of ColorChecker24 (after November 2014), lit by a white sun: ΔE2000 within 0.5 of what its maker
    publishes, from the authored colour over light and material to the EXR's channels and their chromaticities."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # colour-science tells of the optional packages it misses
        colour = pytest.importorskip("colour")
    film = render(scenes / "colorchecker.usda", size=(60, 40), render_space=space)
    patches = film.layers["beauty"][5::10, 5::10, :3].reshape(24, 3).astype(np.float64)
    target = colour.RGB_COLOURSPACES["ACEScg" if space else "sRGB"]
    chart = colour.CCS_COLOURCHECKERS["ColorChecker24 - After November 2014"]
    published = colour.xyY_to_XYZ(np.array(list(chart.data.values())))
    shown = colour.RGB_to_XYZ(patches, target, chart.illuminant, "Bradford", apply_cctf_decoding=False)
    errors = colour.difference.delta_E_CIE2000(
        colour.XYZ_to_Lab(published, chart.illuminant), colour.XYZ_to_Lab(shown, chart.illuminant)
    )
    assert errors.max() < 0.5
