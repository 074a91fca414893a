"""Files made to hurt: circles, depths, counts and paths that lie. Each ends in what can be drawn, or in a sentence."""

from __future__ import annotations

import struct
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf

from defshade_cli import render
from defshade_cli.errors import StageError
from defshade_cli.measure.layouts import first_frame
from defshade_cli.usd.instancing import instancing
from stages import instance

CAMERA = (
    'def Camera "eye" {\ndouble3 xformOp:translate = (0, 0, 9)\nuniform token[] xformOpOrder = ["xformOp:translate"]\n}'
)
BALL = 'def Sphere "ball" (prepend apiSchemas = ["MaterialBindingAPI"]) {\nrel material:binding = </look>\n}'
LOOK = """def Material "look" {
    token outputs:surface.connect = </look/shader.outputs:surface>
    def Shader "shader" {
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
        float inputs:roughness.connect = </look/graph.outputs:a>
        color3f inputs:diffuseColor.connect = </look/texture.outputs:rgb>
    }
    def NodeGraph "graph" {
        float outputs:a.connect = </look/graph.outputs:b>
        float outputs:b.connect = </look/graph.outputs:a>
    }
    def Shader "texture" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @FILE@
        float3 outputs:rgb
    }
}"""
INSTANCER = (
    'def PointInstancer "%s" {\nrel prototypes = </%s>\nint[] protoIndices = [0]\npoint3f[] positions = [(0, 0, 0)]\n}'
)


@pytest.fixture(autouse=True)
def soon() -> Iterator[None]:
    began = time.monotonic()
    yield
    assert time.monotonic() - began < 10.0


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(text: str, metadata: str = "") -> Path:
    path = Path("stage.usda")
    path.write_text(f"#usda 1.0\n({metadata})\n{CAMERA}\n{BALL}\n{text}\n")
    return path


CIRCLES = {
    "sublayer": ("", "subLayers = [@./stage.usda@]", "has cycles"),
    "reference": ('def "x" (references = </x>) {\n}', "", "cycle detected"),
    "file": ('def "x" (references = @./stage.usda@</x>) {\n}', "", "cycle detected"),
    "instance": (
        'def "a" (instanceable = true\nreferences = </b>) {\n}\n'
        'def "b" {\ndef "c" (instanceable = true\nreferences = </a>) {\n}\n}',
        "",
        "cycle detected",
    ),
    "instancer": (INSTANCER % ("i", "i"), "", "part of its own prototype"),
    "instancers": (INSTANCER % ("i", "j") + "\n" + INSTANCER % ("j", "i"), "", "part of its own prototype"),
    "relationship": ('over "look" {\nrel a = </look.b>\nrel b = </look.a>\n}', "", ""),
    "connection": (LOOK.replace("FILE", "none.png"), "", "cycle"),
    "collection": (
        'def SphereLight "l" (prepend apiSchemas = ["CollectionAPI:lightLink", "CollectionAPI:x"]) {\n'
        "rel collection:lightLink:includes = </l.collection:x>\n"
        "rel collection:x:includes = </l.collection:lightLink>\n}",
        "",
        "circular",
    ),
    "variable": (
        'def "x" (references = @`"${A}"`@) {\n}',
        'expressionVariables = {string A = "`\\"${A}\\"`"}',
        "circular",
    ),
}


@pytest.mark.parametrize("circle", CIRCLES)
def test_circles_end(circle: str, caplog: pytest.LogCaptureFixture) -> None:
    text, metadata, said = CIRCLES[circle]
    film = render(write(text, metadata), size=(16, 9))
    assert film.layers["beauty"][..., 3].any()
    assert said in caplog.text.lower()


@pytest.mark.parametrize("depth", [300, 1200])
def test_a_deep_hierarchy_is_drawn(depth: int) -> None:
    path = Path("deep.usdc")
    layer = Sdf.Layer.CreateNew(str(path))
    with Sdf.ChangeBlock():
        parent: Sdf.Layer | Sdf.PrimSpec = layer
        for _ in range(depth):
            parent = Sdf.PrimSpec(parent, "a", Sdf.SpecifierDef, "Xform")
        Sdf.PrimSpec(parent, "ball", Sdf.SpecifierDef, "Sphere")
    layer.Save()
    (drawable,) = first_frame(path).drawables
    assert drawable.paths[0].count("/a") == depth


def test_text_too_deep_for_usd_is_one_sentence() -> None:
    with pytest.raises(StageError, match="is not a USD stage"):
        first_frame(write('def "a" {' * 5000 + "}" * 5000))


def test_instances_of_instances_beyond_count_are_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve that hold each other twice are 4096 balls."""
    monkeypatch.setattr(instancing, "MOST_COPIES", 4000)
    pairs = [instance("a", source=f"s{i}") + instance("b", source=f"s{i}") for i in range(12)]
    nested = "".join(f'class "s{i + 1}" {{\n{pair}\n}}\n' for i, pair in enumerate(pairs))
    with pytest.raises(StageError, match="stands 4,096 times"):
        first_frame(write('class "s0" {\ndef Sphere "x" {\n}\n}\n' + nested + instance("all", source="s12")))


def test_a_resolution_of_no_pixels_is_not_taken() -> None:
    settings = 'def RenderSettings "r" {\nuniform int2 resolution = (-5, 0)\n}'
    film = render(write(settings, 'renderSettingsPrimPath = "/r"'), width=16)
    assert min(film.size) > 0


@pytest.mark.parametrize("file", ["../../../../etc/passwd", "/etc/passwd", "/dev/zero", "."])
def test_a_texture_elsewhere_is_no_picture(file: str, caplog: pytest.LogCaptureFixture) -> None:
    film = render(write(LOOK.replace("FILE", file)), size=(16, 9))
    assert np.isfinite(film.layers["beauty"]).all()
    assert "texture" in caplog.text or "diffuseColor" in caplog.text


def test_a_package_cannot_be_climbed_out_of(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    (folder / "secret.png").write_bytes(b"no picture")
    with zipfile.ZipFile("stage.usdz", "w", zipfile.ZIP_STORED) as package:
        package.write(write(LOOK.replace("FILE", "../secret.png")), "stage.usda")
        package.writestr("../climbed.txt", "x")
    render("stage.usdz", size=(16, 9))
    assert "no file ../secret.png" in caplog.text
    assert not (folder.parent / "climbed.txt").exists()


def test_a_zip_bomb_is_not_unpacked() -> None:
    with zipfile.ZipFile("stage.usdz", "w", zipfile.ZIP_DEFLATED) as package:
        package.writestr("stage.usda", "#usda 1.0\n" + "#" * 50_000_000)
    with pytest.raises(StageError, match="compressed"):
        first_frame(Path("stage.usdz"))


def test_an_entry_of_four_gigabytes_is_none() -> None:
    with zipfile.ZipFile("stage.usdz", "w", zipfile.ZIP_STORED) as package:
        package.write(write(""))
    data = bytearray(Path("stage.usdz").read_bytes())
    for magic, offset in ((b"PK\x01\x02", 20), (b"PK\x03\x04", 18)):
        start = data.index(magic) + offset
        data[start : start + 8] = struct.pack("<II", 0xFFFFFFF0, 0xFFFFFFF0)
    Path("stage.usdz").write_bytes(data)
    with pytest.raises(StageError):
        first_frame(Path("stage.usdz"))


@pytest.mark.parametrize("text", ["", "#usda 1.0\n", "#usda 1.0\ndef Mesh {\n}\n"])
def test_stages_of_nothing_are_one_sentence(text: str) -> None:
    Path("stage.usda").write_text(text)
    with pytest.raises(StageError):
        first_frame(Path("stage.usda"))


def test_prims_of_nothing_are_nothing() -> None:
    kinds = ("Mesh", "Points", "BasisCurves", "NurbsPatch", "PointInstancer", "SkelRoot", "SphereLight", "Material")
    film = render(write("\n".join(f'def {kind} "{kind}" {{\n}}' for kind in kinds)), size=(16, 9))
    assert np.isfinite(film.layers["beauty"]).all()


@pytest.mark.parametrize("frame", [1e9, -1e9, 1e300])
def test_times_far_off_have_a_picture(frame: float, scenes: Path) -> None:
    film = render(scenes / "animated.usda", frame=frame, size=(16, 9))
    assert np.isfinite(film.layers["beauty"]).all()


def test_an_exr_that_claims_100000_texels_a_side_is_no_picture(caplog: pytest.LogCaptureFixture) -> None:
    OpenImageIO = pytest.importorskip("OpenImageIO")
    pixels = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(8, 8, 3, "half"))
    pixels.write("texture.exr")
    data = Path("texture.exr").read_bytes()
    small, huge = struct.pack("<4i", 0, 0, 7, 7), struct.pack("<4i", 0, 0, 99_999, 99_999)
    Path("texture.exr").write_bytes(data.replace(small, huge))
    film = render(write(LOOK.replace("FILE", "./texture.exr")), size=(16, 9))
    assert np.isfinite(film.layers["beauty"]).all()
    assert "texture.exr" in caplog.text


@pytest.mark.parametrize("counts", ["2147483647 2147483647", "-1 -1", "1e9 1", "nan 1", "0 0"])
def test_a_profile_that_claims_absurd_counts_is_none(counts: str, caplog: pytest.LogCaptureFixture) -> None:
    head = "IESNA:LM-63-2002\nTILT=NONE\n"
    Path("light.ies").write_text(f"{head}1 1000 1 {counts} 1 2 0 0 0\n1 1 100\n0 90\n0\n1 1\n")
    shaped = "asset inputs:shaping:ies:file = @./light.ies@"
    light = f'def SphereLight "l" (prepend apiSchemas = ["ShapingAPI"]) {{\n{shaped}\n}}'
    film = render(write(light), size=(16, 9))
    assert np.isfinite(film.layers["beauty"]).all()
    assert "light.ies" in caplog.text
