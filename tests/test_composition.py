"""Variants, masks, session layers and payloads that the user chooses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from defshade_cli.cli.batch import batch
from defshade_cli.cli.inspect import inspect
from defshade_cli.errors import PrimNotFound, StageNotFound
from defshade_cli.farm.fingerprint import Fingerprint
from defshade_cli.image.metadata import provenance
from defshade_cli.rendering import render
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import Composition, RenderJob, VariantChoice
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader

STAGE = """#usda 1.0
def Xform "car" (
    prepend variantSets = ["body", "colour"]
    variants = {
        string body = "small"
    }
) {
    variantSet "body" = {
        "small" {
            def Cube "small" (prepend apiSchemas = ["MaterialBindingAPI"]) {
                rel material:binding = </looks/red>
            }
        }
        "large" (prepend variantSets = ["roof"]) {
            def Cube "large" {}
            variantSet "roof" = { "none" {} "rack" {
                def Cube "rack" {}
            } }
        }
    }
    variantSet "colour" = { "red" {} }
}
def "other" (payload = @./part.usda@</part>) {
    def Sphere "ball" {}
}
def "looks" {
    def Material "red" {
        token outputs:surface.connect = </looks/red/s.outputs:surface>
        def Shader "s" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (1, 0, 0)
            token outputs:surface
        }
    }
}
def Camera "eye" {}
def Camera "second" {}
def SphereLight "lamp" {}
"""
PART = '#usda 1.0\ndef "part" {\n    def Cube "part" {}\n}\n'
SESSION = '#usda 1.0\nover "other" {\n    over "ball" (active = false) {}\n}\n'


@pytest.fixture
def stage(tmp_path: Path) -> Path:
    (tmp_path / "part.usda").write_text(PART)
    (tmp_path / "session.usda").write_text(SESSION)
    (tmp_path / "stage.usda").write_text(STAGE)
    return tmp_path / "stage.usda"


def read(stage: Path, camera: str | None = None, **composition: object) -> Scene:
    opened = open_stage(stage, Composition(**composition), camera)  # type: ignore[arg-type]
    return StageReader(opened, ReadOptions(camera=camera)).read(None)


def names(scene: Scene) -> set[str]:
    return {path for drawable in scene.drawables for path in drawable.paths}


def variants(*texts: str) -> tuple[VariantChoice, ...]:
    return tuple(map(VariantChoice.parse, texts))


def test_a_stage_as_authored(stage: Path) -> None:
    assert names(read(stage)) == {"/car/small", "/other/ball", "/other/part"}


def test_a_variant_is_chosen_over_the_stage(stage: Path) -> None:
    assert "/car/large" in names(read(stage, variants=variants("/car{body=large}")))
    assert not {"/car/large", "/car/small"} & names(read(stage, variants=variants("/car{body=}")))


def test_a_variant_may_bring_the_set_of_the_next(stage: Path) -> None:
    chosen = names(read(stage, variants=variants("/car{body=large}", "/car{roof=rack}")))
    assert {"/car/large", "/car/rack"} <= chosen


@pytest.mark.parametrize(
    ("choice", "problem"),
    [
        ("/bus{body=large}", "there is no prim /bus"),
        ("/car{bodies=large}", "/car has the variant sets body, colour"),
        ("/other{body=large}", "/other has no variant sets"),
        ("/car{body=huge}", "variant set body has the variants large, small"),
    ],
)
def test_a_variant_that_is_not_there_names_those_that_are(stage: Path, choice: str, problem: str) -> None:
    with pytest.raises(PrimNotFound) as caught:
        read(stage, variants=variants(choice))
    assert str(caught.value) == f"{choice}: {problem}"


@pytest.mark.parametrize("text", ["", "/car", "car{a=b}", "/car{a}", "/car{=b}", "/car{a=b}/wheel", "/car{a=b}{c=d}"])
def test_what_chooses_no_variant_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="does not choose a variant"):
        VariantChoice.parse(text)


def test_a_choice_is_written_as_it_is_read() -> None:
    assert str(VariantChoice.parse(" /World/Car{color=red} ")) == "/World/Car{color=red}"


def test_a_mask_keeps_what_its_prims_refer_to_and_the_camera(stage: Path) -> None:
    scene = read(stage, camera="/second", mask=("/car",))
    assert names(scene) == {"/car/small"}
    assert [material.path for material in scene.materials] == ["/looks/red"]
    assert scene.camera.path == "/second"
    assert [light.path for light in scene.lights] == ["<camera light>"]


def test_a_mask_may_name_lights(stage: Path) -> None:
    assert [light.path for light in read(stage, mask=("/car", "/lamp")).lights] == ["/lamp"]


def test_a_mask_over_a_chosen_variant_takes_what_that_brings(stage: Path) -> None:
    assert names(read(stage, mask=("/car",), variants=variants("/car{body=large}"))) == {"/car/large"}


def test_collections_of_bindings_do_not_undo_a_mask(stage: Path) -> None:
    stage.write_text(
        STAGE.replace(
            'def "other" (',
            """def "set" (prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:all"]) {
                rel collection:all:includes = </other>
                rel material:binding:collection:all = [</set.collection:all>, </looks/red>]
                def Cube "cube" {}
            }
            def "other" (""",
        )
    )
    assert names(read(stage, mask=("/set",))) == {"/set/cube"}


@pytest.mark.parametrize(
    ("path", "problem"),
    [("/bus", "there is no prim /bus to limit"), ("/car.size", "no path of a prim"), ("/a b", "no path of a prim")],
)
def test_a_mask_of_what_is_not_there_says_so(stage: Path, path: str, problem: str) -> None:
    with pytest.raises(PrimNotFound, match=problem):
        read(stage, mask=(path,))


def test_a_session_layer_lies_over_the_stage(stage: Path) -> None:
    scene = read(stage, session_layers=(stage.parent / "session.usda",))
    assert names(scene) == {"/car/small", "/other/part"}


def test_a_session_layer_that_is_missing_says_so(stage: Path) -> None:
    with pytest.raises(StageNotFound, match=r"no such file: .*gone\.usda"):
        read(stage, session_layers=(stage.parent / "gone.usda",))


def test_payloads_may_stay_away(stage: Path) -> None:
    assert names(read(stage, payloads="none")) == {"/car/small"}


def test_every_choice_changes_the_fingerprint(stage: Path) -> None:
    choices = [
        Composition(),
        Composition(variants=variants("/car{body=large}")),
        Composition(variants=variants("/car{body=}")),
        Composition(mask=("/car",)),
        Composition(payloads="none"),
        Composition(session_layers=(stage.parent / "session.usda",)),
    ]
    made_of = [Fingerprint(RenderJob(stage, composition=choice)).of(None) for choice in choices]
    assert len(set(made_of)) == len(choices) and "" not in made_of
    (stage.parent / "session.usda").write_text("#usda 1.0\n")
    assert Fingerprint(RenderJob(stage, composition=choices[-1])).of(None) not in made_of


def test_choices_are_told_by_name(stage: Path) -> None:
    assert Composition().choices == {}
    chosen = Composition((stage,), variants("/a{b=c}", "/d{e=f}"), ("/a", "/d"), "none")
    assert chosen.choices == {
        "session_layers": "stage.usda",
        "variants": "/a{b=c} /d{e=f}",
        "mask": "/a, /d",
        "payloads": "none",
    }


def test_choices_reach_the_picture_and_its_header(stage: Path) -> None:
    chosen = Composition(mask=("/car",), variants=variants("/car{body=large}"))
    film = render(stage, composition=chosen, size=(4, 4))
    facts = provenance(film)
    assert facts["variants"] == "/car{body=large}" and facts["mask"] == "/car"
    assert "payloads" not in facts


def run(command: object, *arguments: str) -> str:
    done = CliRunner().invoke(command, arguments, catch_exceptions=False)  # type: ignore[arg-type]
    assert done.exit_code == 0, done.output
    return done.stdout


def test_inspect_sees_the_stage_as_chosen(stage: Path) -> None:
    record = json.loads(run(inspect, str(stage), "--mask", "/car,/lamp", "--variant", "/car{body=large}", "--json"))
    assert record["composition"] == {"variants": "/car{body=large}", "mask": "/car, /lamp"}
    assert record["geometry"]["meshes"] == 1 and record["lights"][0]["path"] == "/lamp"


@pytest.mark.parametrize(
    ("option", "value", "mention"),
    [
        ("--variant", "/car", "does not choose a variant"),
        ("--mask", "car", "is no path"),
        ("--payloads", "some", "all"),
    ],
)
def test_what_cannot_be_a_choice_is_refused(stage: Path, option: str, value: str, mention: str) -> None:
    done = CliRunner().invoke(inspect, [str(stage), option, value])
    assert done.exit_code == 2 and mention in done.output


def test_a_job_file_says_the_same_as_options(stage: Path) -> None:
    (stage.parent / "job.yaml").write_text(
        "stages: [stage.usda]\n"
        "settings:\n"
        "  variant: ['/car{body=large}', '/car{roof=rack}']\n"
        "  mask: [/car, /lamp]\n"
        "  session-layer: session.usda\n"
        "  payloads: none\n"
    )
    (step,) = yaml.safe_load(run(batch, str(stage.parent / "job.yaml"), "--emit", "openjd"))["steps"]
    arguments = step["script"]["actions"]["onRun"]["args"]
    for typed in (
        ["--variant", "/car{body=large}", "--variant", "/car{roof=rack}"],
        ["--mask", "/car,/lamp"],
        ["--session-layer", str(stage.parent / "session.usda")],
        ["--payloads", "none"],
    ):
        assert " ".join(typed) in " ".join(arguments)


def test_a_relative_session_layer_starts_from_the_folder_of_the_job(stage: Path) -> None:
    (step,) = yaml.safe_load(run(batch, "a.usda", "--session-layer", "over.usda", "--emit", "openjd"))["steps"]
    assert "{{Param.Folder}}/over.usda" in step["script"]["actions"]["onRun"]["args"]


CLIPPED = """#usda 1.0
def Cube "stays" {}
def Cube "blinks" (
    clips = {
        dictionary default = {
            asset[] assetPaths = [@./clip.usda@]
            asset manifestAssetPath = @./manifest.usda@
            string primPath = "/blinks"
            double2[] active = [(0, 0)]
            double2[] times = [(0, 0), (10, 10)]
        }
    }
) {}
"""
CLIP = """#usda 1.0
def Cube "blinks" {
    double size.timeSamples = { 0: 1, 10: 3 }
    token visibility.timeSamples = { 0: "inherited", 8: "invisible" }
}
"""


def test_what_value_clips_alone_say_counts(tmp_path: Path) -> None:
    """Neither attribute is authored on the stage, where USD lists what a prim has."""
    (tmp_path / "clip.usda").write_text(CLIP)
    (tmp_path / "manifest.usda").write_text('#usda 1.0\nover "blinks" {\n double size\n token visibility\n}\n')
    (tmp_path / "shot.usda").write_text(CLIPPED)
    reader = StageReader(open_stage(tmp_path / "shot.usda"))
    sizes = [np.ptp(reader.read(frame).meshes[1].points) for frame in (0.0, 5.0)]
    assert sizes == [1.0, 2.0] and names(reader.read(9.0)) == {"/stays"}


def clipped(folder: Path, mesh: str, values: str, manifest: str) -> StageReader:
    """Of a mesh with CLIPPED's clips, which have these values."""
    clips = CLIPPED[CLIPPED.index("clips = ") : CLIPPED.rindex(")")]
    for name, text in (("clip", values), ("manifest", manifest), ("shot", mesh.replace("CLIPS", clips))):
        (folder / f"{name}.usda").write_text(f"#usda 1.0\n{text}\n")
    return StageReader(open_stage(folder / "shot.usda"))


def test_clips_alone_colour_a_mesh_that_moves(tmp_path: Path) -> None:
    """USD does not list such a primvar among those of the prim."""
    mesh = """def Mesh "blinks" (CLIPS) {
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
    }"""
    values = """over "blinks" {
        color3f[] primvars:displayColor.timeSamples = { 0: [(1, 0, 0)], 10: [(0, 0, 1)] }
        point3f[] points.timeSamples = { 0: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], 10: [(0, 0, 1), (1, 0, 0), (0, 1, 0)] }
    }"""
    manifest = 'over "blinks" {\ncolor3f[] primvars:displayColor\npoint3f[] points\n}'
    reader = clipped(tmp_path, mesh, values, manifest)
    for frame in (0.0, 5.0):
        (drawable,) = reader.read(frame).drawables
        np.testing.assert_allclose(drawable.display_color, [(1 - frame / 10, 0, frame / 10)])


def test_a_mesh_that_clips_leave_empty_for_a_while_is_waited_for(tmp_path: Path) -> None:
    mesh = 'def Mesh "blinks" (CLIPS) {\npoint3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n}'
    values = """over "blinks" {
        int[] faceVertexCounts.timeSamples = { 0: [], 5: [3] }
        int[] faceVertexIndices.timeSamples = { 0: [], 5: [0, 1, 2] }
    }"""
    manifest = 'over "blinks" {\nint[] faceVertexCounts\nint[] faceVertexIndices\n}'
    reader = clipped(tmp_path, mesh, values, manifest)
    assert [len(reader.read(frame).drawables) for frame in (0.0, 5.0)] == [0, 1]
