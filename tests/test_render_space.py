"""The render space: where scenes' colours are taken to, and what files say of it."""

from __future__ import annotations

import os
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from defshade_cli import render
from defshade_cli.errors import UsageError
from defshade_cli.image import files
from defshade_cli.image.ocio import find_render_space
from defshade_cli.image.render_space import REC709
from defshade_cli.settings import OutputSettings
from films import film

pytestmark = pytest.mark.skipif("OCIO" in os.environ, reason="these tests speak of the built-in config")

COLOUR_SCIENCE = {"ACEScg": "ACEScg", "lin_rec2020": "ITU-R BT.2020", "lin_ap0_scene": "ACES2065-1"}


@pytest.mark.parametrize("name", COLOUR_SCIENCE)
def test_matrices_are_those_of_colour_science(name: str) -> None:
    """Both adapt the white by Bradford; ACES's config and the library round their matrices in the fourth decimal."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # colour-science tells of the optional packages it misses
        colour = pytest.importorskip("colour")
    space = find_render_space(name)
    target = colour.RGB_COLOURSPACES[COLOUR_SCIENCE[name]]
    matrix = colour.matrix_RGB_to_RGB(colour.RGB_COLOURSPACES["sRGB"], target, "Bradford")
    np.testing.assert_allclose(space.from_rec709, matrix, atol=3e-4)
    np.testing.assert_allclose(space.chromaticities, [*target.primaries.ravel(), *target.whitepoint], atol=1e-4)


@pytest.mark.parametrize("name", COLOUR_SCIENCE)
def test_white_stays_white(name: str) -> None:
    np.testing.assert_allclose(np.array(find_render_space(name).from_rec709) @ np.ones(3), 1.0, atol=1e-5)


@pytest.mark.parametrize("name", [None, "lin_rec709", "lin_rec709_scene", "Linear Rec.709 (sRGB)"])
def test_rec709_needs_no_conversion(name: str | None) -> None:
    assert find_render_space(name).is_rec709


@pytest.mark.parametrize("name", ["sRGB - Display", "ACEScct", "nonsense", "Raw"])
def test_what_is_not_scene_linear_is_refused_with_what_is(name: str) -> None:
    with pytest.raises(UsageError, match=rf"no scene-linear space '{name}'.*ACEScg"):
        find_render_space(name)


def test_roles_are_names_too() -> None:
    assert find_render_space("scene_linear").name == "ACEScg"


def test_light_and_reflectance_meet_in_the_render_space(tmp_path: Path) -> None:
    """A Lambertian floor of base a under light c: a · c in Rec.709, M a · M c in the space that M leads to."""
    stage = tmp_path / "floor.usda"
    stage.write_text(FLOOR)
    options = {"size": (8, 8), "shadows": False}
    space = find_render_space("ACEScg")
    plain, shown = render(stage, **options), render(stage, render_space="ACEScg", **options)
    assert shown.render_space == space
    matrix = np.array(space.from_rec709)
    factor = plain.layers["beauty"][4, 4, :3] / (BASE * LIGHT)
    np.testing.assert_allclose(factor, factor[0], rtol=1e-3)
    np.testing.assert_allclose(
        shown.layers["beauty"][4, 4, :3], factor[0] * (matrix @ BASE) * (matrix @ LIGHT), rtol=1e-3
    )


BASE, LIGHT = np.array([0.7, 0.1, 0.3]), np.array([0.2, 1.0, 0.5])
FLOOR = f"""#usda 1.0
( upAxis = "Y" )
def Camera "c" {{
    float2 clippingRange = (0.1, 100)
    token projection = "orthographic"
    float horizontalAperture = 10
    float verticalAperture = 10
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def DistantLight "sun" {{
    float inputs:angle = 0
    float inputs:intensity = 1
    color3f inputs:color = {tuple(LIGHT.tolist())}
    float inputs:specular = 0
}}
def Mesh "floor" {{
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    rel material:binding = </m>
}}
def Material "m" {{
    token outputs:surface.connect = </m/s.outputs:surface>
    def Shader "s" {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = {tuple(BASE.tolist())}
        float inputs:ior = 1
        token outputs:surface
    }}
}}
"""


def test_files_name_their_space(tmp_path: Path) -> None:
    space = find_render_space("ACEScg")
    files.write(film("beauty", render_space=space), OutputSettings(), tmp_path / "a.exr")
    spec = oiio.ImageInput.open(str(tmp_path / "a.exr")).spec()
    assert spec.getattribute("oiio:ColorSpace") in ("lin_ap1_scene", "ACEScg")
    np.testing.assert_allclose(spec.getattribute("chromaticities"), space.chromaticities)


def test_pictures_look_the_same_from_every_space(tmp_path: Path) -> None:
    """One colour in two spaces through one view: equal to a step of 10 bits."""
    frame = film("beauty")
    space = find_render_space("ACEScg")
    moved = frame.layers["beauty"].copy()
    moved[..., :3] = moved[..., :3] @ np.array(space.from_rec709).T
    shown = []
    for pixels, its in ((frame.layers["beauty"], REC709), (moved.astype(np.float32), space)):
        moved_film = replace(frame, layers={"beauty": pixels}, render_space=its)
        files.write(moved_film, OutputSettings(bits=16), tmp_path / "a.png")
        shown.append(oiio.ImageBuf(str(tmp_path / "a.png")).get_pixels(oiio.FLOAT))
    np.testing.assert_allclose(shown[0], shown[1], atol=1 / 1023)


def test_a_look_changes_the_picture_and_unknown_ones_are_listed(tmp_path: Path) -> None:
    look = OutputSettings(look="ACES 1.3 Reference Gamut Compression", view="Un-tone-mapped", bits=16)
    files.write(film("beauty"), look, tmp_path / "a.png")
    files.write(film("beauty"), OutputSettings(view="Un-tone-mapped", bits=16), tmp_path / "b.png")
    a, b = (oiio.ImageBuf(str(tmp_path / name)).get_pixels(oiio.FLOAT) for name in ("a.png", "b.png"))
    assert np.abs(a - b).max() > 1e-3
    with pytest.raises(UsageError, match=r"no look 'Noir'.*ACES 1\.3 Reference Gamut Compression"):
        files.write(film("beauty"), OutputSettings(look="Noir"), tmp_path / "c.png")


def test_a_config_by_name() -> None:
    name = "ocio://cg-config-v2.1.0_aces-v1.3_ocio-v2.3"
    space = find_render_space("ACEScg", name)
    assert (space.interop_id, space.config) == ("lin_ap1_scene", name)
    with pytest.raises(UsageError, match=r"OCIO config cannot be used.*none"):
        find_render_space("ACEScg", "none.ocio")
