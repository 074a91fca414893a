"""UsdRender: settings, products and variables, from the prims to the files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from click.testing import CliRunner, Result

from defshade_cli.cli.inspect import inspect
from defshade_cli.cli.render import render
from defshade_cli.errors import DefshadeError, EmptyStage, UsageError
from defshade_cli.farm.shots import make_shot
from defshade_cli.image.layers.variables import layer_of
from defshade_cli.image.reading import read, read_header
from defshade_cli.scene.product import Product, Variable
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import OutputSettings, RenderJob
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader
from defshade_cli.usd.render_settings.products import read_products

STAGE = """#usda 1.0
( renderSettingsPrimPath = "/Render/final" )
def Cube "cube" {}
def Cube "hidden" {
    uniform token purpose = "proxy"
}
def DistantLight "sun" {}
def Camera "front" {
    float2 clippingRange = (0.1, 100)
    double3 xformOp:translate = (0, 0, 8)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Camera "side" {
    float2 clippingRange = (0.1, 100)
    double3 xformOp:translate = (8, 0, 0)
    float xformOp:rotateY = 90
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]
}
def Scope "Render" {
    def RenderSettings "final" {
        rel camera = </front>
        int2 resolution = (32, 18)
        rel products = [</Render/wide>, </Render/aovs>, </Render/deep>]
    }
    def RenderSettings "draft" {
        rel camera = </side>
        int2 resolution = (16, 9)
        uniform token[] includedPurposes = ["default", "proxy"]
        rel products = </Render/wide>
    }
    def RenderPass "pass" {
        rel renderSource = </Render/draft>
    }
    def RenderProduct "wide" {
        token productName = "out/wide.exr"
        rel orderedVars = [</Render/Vars/Ci>, </Render/Vars/gone>, </Render/Vars/a>]
    }
    def RenderProduct "aovs" {
        rel camera = </side>
        int2 resolution = (24, 24)
        token productName = "aovs.exr"
        rel orderedVars = [</Render/Vars/zed>, </Render/Vars/nrm>, </Render/Vars/odd>, </Render/Vars/lit>]
    }
    def RenderProduct "deep" {
        uniform token productType = "deepRaster"
    }
    def Scope "Vars" {
        def RenderVar "Ci" {
            string sourceName = "Ci"
        }
        def RenderVar "a" {
            token dataType = "float"
        }
        def RenderVar "zed" {
            string sourceName = "z"
            token dataType = "float"
        }
        def RenderVar "nrm" {
            string sourceName = "Nn"
            token dataType = "normal3f"
        }
        def RenderVar "odd" {
            string sourceName = "crowdDensity"
        }
        def RenderVar "lit" {
            string sourceName = "C.*"
            token sourceType = "lpe"
        }
    }
}
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("shot.usda").write_text(STAGE)
    return tmp_path


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(render, [*arguments, "--progress", "none"])


def rendered(*arguments: str) -> list[str]:
    done = invoke(*arguments)
    assert done.exception is None, done.exception
    return done.stdout.split()


def spec_of(path: str) -> oiio.ImageSpec:
    return oiio.ImageInput.open(path).spec()


def test_every_product_is_made_under_its_name(caplog: pytest.LogCaptureFixture) -> None:
    assert rendered("shot.usda") == ["out/wide.exr", "aovs.exr"]
    wide, aovs = spec_of("out/wide.exr"), spec_of("aovs.exr")
    assert ((wide.width, wide.height), sorted(wide.channelnames)) == ((32, 18), ["B", "G", "R", "a.A"])
    assert ((aovs.width, aovs.height), sorted(aovs.channelnames)) == (
        (24, 24),
        ["B", "G", "R", "nrm.X", "nrm.Y", "nrm.Z", "zed.Z"],
    )


def test_what_is_left_out_is_told() -> None:
    told = invoke("shot.usda").stderr
    assert told.count("no layer answers odd (raw crowdDensity)") == 1
    assert "/Render/deep is left out: deep images are not rendered" in told
    assert "/Render/wide names a variable /Render/Vars/gone that the stage lacks" in told


def test_a_product_by_name_and_settings_by_path() -> None:
    assert rendered("shot.usda", "--product", "aovs") == ["aovs.exr"]
    assert rendered("shot.usda", "--settings", "/Render/draft") == ["out/wide.exr"]
    assert spec_of("out/wide.exr").width == 16


def test_a_pass_leads_to_its_settings() -> None:
    assert rendered("shot.usda", "--settings", "/Render/pass") == ["out/wide.exr"]
    assert spec_of("out/wide.exr").width == 16


def test_the_command_line_goes_before_the_stage() -> None:
    assert rendered("shot.usda", "--size", "8x8", "--layers", "depth", "--camera", "front") == [
        "out/wide.exr",
        "aovs.exr",
    ]
    for path in ("out/wide.exr", "aovs.exr"):
        assert (spec_of(path).width, spec_of(path).channelnames) == (8, ("depth.Z",))


def test_an_output_holds_the_first_product_or_says_which() -> None:
    assert rendered("shot.usda", "-o", "one.exr") == ["one.exr"]
    assert rendered("shot.usda", "-o", "{product}.exr") == ["wide.exr", "aovs.exr"]


def test_several_frames_have_names_of_their_own() -> None:
    assert rendered("shot.usda", "--frames", "1:2", "--product", "aovs") == ["aovs.0001.exr", "aovs.0002.exr"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (
            ("--settings", "/Render/none"),
            "no render settings at '/Render/none'; the stage has /Render/final, /Render/draft",
        ),
        (("--product", "none"), "no product 'none'; the render settings name /Render/wide, /Render/aovs"),
    ],
)
def test_what_the_stage_lacks_is_listed(arguments: tuple[str, str], told: str) -> None:
    error = invoke("shot.usda", *arguments).exception
    assert isinstance(error, DefshadeError) and told in str(error)


@pytest.mark.parametrize("name", ["/etc/x.exr", "../x.exr", "a/../../x.exr"])
def test_a_stage_writes_nowhere_but_here(name: str) -> None:
    job = RenderJob(Path("a.usda"), output=OutputSettings(fallback="{scene}.exr"))
    with pytest.raises(UsageError, match="outside the current folder"):
        make_shot(job, 1.0, Product("/Render/p", name), "cam")


@pytest.mark.parametrize(
    ("variable", "layer"),
    [
        (Variable("x", "RGBA"), "beauty"),
        (Variable("x", "P"), "position"),
        (Variable("x", "C.*", "lpe"), "beauty"),
        (Variable("x", "lpe: C O", "lpe"), "emission"),
        (Variable("x", "C<RD>.<RS>L", "lpe"), None),
        (Variable("x", "whatever"), None),
    ],
)
def test_variables_as_layers(variable: Variable, layer: str | None) -> None:
    assert layer_of(variable) == layer


def test_products_of_animcube(assets: Path) -> None:
    assert rendered(str(assets / "ousd_usdrecord_animcube" / "AnimCube.usda")) == ["test.exr"]
    spec = spec_of("test.exr")
    assert (spec.width, spec.height, sorted(spec.channelnames)) == (2048, 1080, ["B", "G", "R"])


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_products_of_four_settings(number: int, assets: Path) -> None:
    stage = assets / "arnold_render_settings_a" / "test_0203" / "data" / "scene.usda"
    with pytest.raises(EmptyStage):
        raise invoke(str(stage), "--settings", f"/Render/rendersettings{number}").exception or AssertionError
    (product,) = read_products(open_stage(stage), f"/Render/rendersettings{number}", 1.0)
    assert (product.file, [v.source for v in product.variables]) == ("testrender.tif", ["RGBA"])


def test_a_product_is_named_by_the_frame(assets: Path) -> None:
    stage = assets / "arnold_render_settings_a" / "test_2300" / "data" / "test.usda"
    assert rendered(str(stage), "--frames", "1010") == ["testrender.tif"]
    spec = spec_of("testrender.tif")
    assert (spec.width, spec.height, spec.nchannels) == (160, 120, 4)


PASSES = """#usda 1.0
def Xform "set" {
    def Sphere "kept" {
    }
    def Sphere "pruned" {
    }
    def Sphere "hidden" {
        def Cube "inside" {
        }
    }
}
def SphereLight "key" {
}
def SphereLight "fill" {
}
def RenderSettings "settings" {
}
def RenderPass "pass" {
    rel renderSource = </settings>
    rel collection:prune:includes = </set/pruned>
    uniform bool collection:renderVisibility:includeRoot = 1
    rel collection:renderVisibility:excludes = [</set/hidden>, </fill>]
    rel collection:renderVisibility:includes = </set/hidden/inside>
    rel collection:matte:includes = </set/kept>
}
"""


def placed(scene: Scene) -> int:
    """Copies of meshes in the world; equal ones share a drawable."""
    return sum(len(drawable.world_from_object) for drawable in scene.drawables)


def test_a_pass_prunes_and_hides() -> None:
    Path("pass.usda").write_text(PASSES)
    scene = StageReader(open_stage(Path("pass.usda")), ReadOptions(render_settings="/pass")).read(None)
    assert placed(scene) == 2
    assert [light.path for light in scene.lights] == ["/key"]
    assert [str(issue.reason) for issue in scene.unsupported] == ["its collection matte is not followed"]


def test_settings_alone_hide_nothing() -> None:
    Path("pass.usda").write_text(PASSES)
    scene = StageReader(open_stage(Path("pass.usda")), ReadOptions(render_settings="/settings")).read(None)
    assert (placed(scene), len(scene.lights)) == (4, 2)


BOUND = """#usda 1.0
def Cube "cube" ( prepend apiSchemas = ["MaterialBindingAPI"] ) {
    rel material:binding = </red>
    rel material:binding:preview = </blue>
}
def RenderSettings "plain" {
}
def RenderSettings "preview" {
    uniform token[] materialBindingPurposes = ["preview", ""]
}
def RenderSettings "everywhere" {
    uniform token[] materialBindingPurposes = ["full", ""]
}
""" + "".join(
    f"""def Material "{name}" {{
    token outputs:surface.connect = </{name}/s.outputs:surface>
    def Shader "s" {{
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }}
}}
"""
    for name in ("red", "blue")
)


@pytest.mark.parametrize(("settings", "material"), [("plain", "/blue"), ("preview", "/blue"), ("everywhere", "/red")])
def test_purposes_of_bindings(settings: str, material: str) -> None:
    """Without a word of the settings a preview goes before what is bound for all purposes, as for `usdview`."""
    Path("bound.usda").write_text(BOUND)
    scene = StageReader(open_stage(Path("bound.usda")), ReadOptions(render_settings=f"/{settings}")).read(None)
    assert [each.path for each in scene.materials] == [material]


def test_a_command_line_becomes_part_of_a_stage() -> None:
    """What inspect saves, laid over the stage, renders what the options did; options still go before it."""
    options = ["--camera", "/side", "--size", "20x10", "--crop", "10x5+2+1", "--samples", "3", "--no-shadows"]
    options += ["--layers", "beauty,depth", "--purposes", "default,proxy", "--exposure", "1.5", "--shading", "classic"]
    typed = rendered("shot.usda", *options, "-o", "typed.exr")
    done = CliRunner().invoke(inspect, ["shot.usda", *options, "--save-settings", "saved.usda"])
    assert done.exception is None
    laid_over = ["shot.usda", "--session-layer", "saved.usda", "--settings", "/Render/settings"]
    saved = rendered(*laid_over, "-o", "saved.exr")
    for name, pixels in read(Path(*typed)).items():
        np.testing.assert_array_equal(read(Path(*saved))[name], pixels)
    header = read_header(Path(*rendered(*laid_over, "--samples", "2", "-o", "two.exr")))
    assert header["samples"] == 2


@pytest.mark.parametrize(
    ("authored", "told"),
    [
        ("int defshade:filter = 3", "defshade:filter of the render settings is 3, not of type str"),
        ('token defshade:filter = "sinc"', "is 'sinc'; there are box, gaussian, blackman-harris"),
    ],
)
def test_settings_of_ours_are_checked(authored: str, told: str) -> None:
    Path("ours.usda").write_text(
        f'#usda 1.0\ndef Cube "c" {{\n}}\ndef Scope "Render" {{\ndef RenderSettings "s" {{\n{authored}\n}}\n}}'
    )
    assert told in str(invoke("ours.usda").exception)
