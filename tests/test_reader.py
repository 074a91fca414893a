"""Stages as scenes: what is drawn, where and when; and every stage by others that lies at hand."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from defshade_cli.errors import DefshadeError, EmptyStage
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader
from stages import column_vectors, placed, positions, read, reasons, stage_of, stages_in

CUBE = 'def Cube "cube" {\n}\n'


# Where


def test_matrices_are_column_vectors() -> None:
    """Scale, then rotate, then translate: (1, 0, 0) → (2, 0, 0) → (0, 2, 0) → (10, 2, 0)."""
    text = """def Cube "cube" {
        double3 xformOp:translate = (10, 0, 0)
        float xformOp:rotateZ = 90
        float3 xformOp:scale = (2, 2, 2)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ", "xformOp:scale"]
    }"""
    world_from_object = placed(read(text))["/cube"]
    np.testing.assert_allclose(world_from_object @ [1, 0, 0, 1], [10, 2, 0, 1], atol=1e-12)


NESTED = """def Xform "a" {
    float xformOp:rotateX = 30
    double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (0, 5, 0) }
    uniform token[] xformOpOrder = ["xformOp:rotateX", "xformOp:translate"]
    def "untyped" {
        def Cube "child" {
            float3 xformOp:scale = (1, -2, 3)
            uniform token[] xformOpOrder = ["xformOp:scale"]
        }
        def Xform "apart" {
            double3 xformOp:translate = (7, 0, 0)
            uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]
            def Sphere "grandchild" {
                double3 xformOp:translate = (0, 0, 1)
                uniform token[] xformOpOrder = ["xformOp:translate"]
            }
        }
    }
}
"""


@pytest.mark.parametrize("frame", [None, 0.0, 5.0, 10.0, 99.0])
def test_matrices_are_usds_at_every_time(frame: float | None) -> None:
    stage = stage_of(NESTED)
    time = Usd.TimeCode.Default() if frame is None else Usd.TimeCode(frame)
    reader = StageReader(stage)
    reader.read(3.0)
    found = placed(reader.read(frame))
    assert sorted(found) == ["/a/untyped/apart/grandchild", "/a/untyped/child"]
    for path, world_from_object in found.items():
        expected = UsdGeom.Imageable(stage.GetPrimAtPath(path)).ComputeLocalToWorldTransform(time)
        np.testing.assert_allclose(world_from_object, column_vectors(expected), atol=1e-12)


# What


def test_only_what_is_defined_active_and_concrete_is_drawn() -> None:
    text = """class "abstract" {
        def Cube "a" {
        }
    }
    over "pure" {
        def Cube "b" {
        }
    }
    def Xform "off" (active = false) {
        def Cube "c" {
        }
    }
    def Xform "on" {
        def Cube "d" {
        }
    }"""
    assert list(placed(read(text))) == ["/on/d"]


def test_visibility_is_inherited_and_may_vary() -> None:
    text = """def Xform "group" {
        token visibility.timeSamples = { 0: "inherited", 5: "invisible", 8: "inherited" }
        def Cube "a" {
        }
        def Cube "b" {
            token visibility = "invisible"
        }
    }
    """
    reader = StageReader(stage_of(text + CUBE))
    drawn = [sorted(placed(reader.read(frame))) for frame in (0, 5, 7, 8)]
    assert drawn == [["/cube", "/group/a"], ["/cube"], ["/cube"], ["/cube", "/group/a"]]


PURPOSES = """def "untyped" {
    uniform token purpose = "proxy"
    token visibility = "invisible"
    def Cube "ignores" {
    }
}
def Xform "guides" {
    uniform token purpose = "guide"
    def Cube "inherits" {
    }
    def "untyped" {
        def Cube "inherits" {
        }
    }
    def Cube "back" {
        uniform token purpose = "default"
    }
}
def Cube "proxy" {
    uniform token purpose = "proxy"
}
def Cube "render" {
    uniform token purpose = "render"
}
def Cube "plain" {
}
"""


@pytest.mark.parametrize(
    "purposes", [(), ("default",), ("default", "render"), ("default", "proxy"), ("guide", "proxy")]
)
def test_purposes_are_as_usd_computes_them(purposes: tuple[str, ...]) -> None:
    stage = stage_of(PURPOSES)
    gprims = [UsdGeom.Imageable(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Gprim)]
    expected = {str(gprim.GetPath()) for gprim in gprims if gprim.ComputePurposeInfo().purpose in purposes}
    if not expected:
        with pytest.raises(EmptyStage):
            StageReader(stage, ReadOptions(purposes=purposes)).read(None)
    else:
        assert set(placed(StageReader(stage, ReadOptions(purposes=purposes)).read(None))) == expected


@pytest.mark.parametrize("name", ["InheritedPurposes.usd", "InheritedPurposes_Instanced.usd"])
def test_purposes_of_a_stage_by_others(assets: Path, name: str) -> None:
    stage = open_stage(assets / "ousd_purpose_a" / name)
    prims = Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
    for purposes in (("default",), ("default", "render"), ("default", "proxy", "guide")):
        expected = {
            str(prim.GetPath())
            for prim in prims
            if prim.IsA(UsdGeom.Gprim) and UsdGeom.Imageable(prim).ComputePurposeInfo().purpose in purposes
        }
        assert set(placed(StageReader(stage, ReadOptions(purposes=purposes)).read(None))) == expected


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('def HermiteCurves "x" {\n}', "prims of type HermiteCurves are not drawn"),
        ('def GenerativeProcedural "x" {\n}', "prims of type GenerativeProcedural are not drawn"),
        ('def Hologram "x" {\n}', "no schema defines the type Hologram"),
    ],
)
def test_what_is_left_out_is_reported(text: str, reason: str) -> None:
    assert reasons(read(CUBE + text), "/x") == [reason]


def test_an_untouched_stage_reports_nothing() -> None:
    kinds = ("Scope", "Camera", "SkelRoot", "Material", "SphereLight", "HoudiniLayerInfo")
    text = CUBE + "".join(f'def {kind} "{kind}" {{\n}}\n' for kind in kinds)
    assert read(text).unsupported == ()


def test_colors_are_the_prims_else_grey() -> None:
    text = (
        'def Cube "red" {\ncolor3f[] primvars:displayColor = [(1, 0, 0)]\nfloat[] primvars:displayOpacity = [0.5]\n}\n'
    )
    (cubes,) = read(text + CUBE).drawables
    np.testing.assert_allclose(cubes.display_color, [[1, 0, 0], [0.18, 0.18, 0.18]])
    np.testing.assert_allclose(cubes.display_opacity, [0.5, 1])


def test_the_scene_says_where_it_comes_from() -> None:
    scene = read(CUBE, 7.0, 'upAxis = "Z"\nmetersPerUnit = 1\nframesPerSecond = 25')
    assert (scene.name, scene.frame, scene.up_axis, scene.meters_per_unit, scene.frames_per_second) == (
        "test",
        7.0,
        "Z",
        1.0,
        25.0,
    )


# Empty stages


@pytest.mark.parametrize("text", ["", 'def Xform "x" {\n}', 'def Cube "c" {\ntoken visibility = "invisible"\n}'])
def test_a_stage_without_geometry_is_empty(text: str) -> None:
    with pytest.raises(EmptyStage, match=r"test\.usda has nothing to draw$"):
        read(text)


def test_an_empty_stage_says_what_is_left_out() -> None:
    with pytest.raises(EmptyStage, match="nothing to draw: /p: prims of type HermiteCurves are not drawn"):
        read('def HermiteCurves "p" {\n}')


def test_a_frame_in_which_all_is_hidden_for_a_while_is_a_picture_of_nothing() -> None:
    text = 'def Cube "c" {\ntoken visibility.timeSamples = { 0: "inherited", 5: "invisible" }\n}'
    reader = StageReader(stage_of(text))
    assert len(reader.read(0).drawables) == 1
    nothing = reader.read(5)
    assert nothing.drawables == () and len(nothing.lights) == 1
    assert np.isfinite(nothing.camera.world_from_camera).all()


# From frame to frame


@pytest.mark.parametrize("metadata", ["", "startTimeCode = 1\nendTimeCode = 3"])
def test_splines_move_with_or_without_a_range_of_times(metadata: str) -> None:
    text = 'def Cube "c" {\ndouble size.spline = {\nbezier,\n1: 1; post linear,\n3: 3; post held,\n}\n}'
    reader = StageReader(stage_of(text, metadata))
    assert [np.ptp(reader.read(frame).meshes[0].points) for frame in (1, 2, 3)] == [1, 2, 3]


MOVING = """def Cube "still" {
    double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (10, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Sphere "grows" {
    double radius.timeSamples = { 0: 1, 10: 2 }
}
"""


def test_a_mesh_that_does_not_change_is_the_same_object() -> None:
    reader = StageReader(stage_of(MOVING))
    first, later = reader.read(0), reader.read(10)
    assert first.meshes[0] is later.meshes[0]
    assert first.meshes[1] is not later.meshes[1]
    np.testing.assert_allclose(later.meshes[1].bounds, 2 * first.meshes[1].bounds)
    np.testing.assert_allclose(placed(later)["/still"][:3, 3], [10, 0, 0])


def test_frames_may_come_in_any_order() -> None:
    reader = StageReader(stage_of(MOVING))
    for frame in (10, 0, 5, 0, None, 10):
        fresh = StageReader(stage_of(MOVING)).read(frame)
        again = reader.read(frame)
        np.testing.assert_array_equal(placed(again)["/still"], placed(fresh)["/still"])
        np.testing.assert_array_equal(again.meshes[1].points, fresh.meshes[1].points)


def test_the_first_frame_is_the_stages() -> None:
    assert StageReader(stage_of(CUBE, "startTimeCode = 12\nendTimeCode = 20")).first_frame() == 12.0
    assert StageReader(stage_of(CUBE)).first_frame() is None


def test_usd_does_not_scroll_while_reading(capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture) -> None:
    """Bindings without the API schema: one line for all of them."""
    cubes = "".join(f'def Cube "c{i}" {{\nrel material:binding = </m>\n}}\n' for i in range(5))
    with caplog.at_level(logging.WARNING, "defshade"):
        read('def Material "m" {\n}\n' + cubes)
    assert capfd.readouterr().err == ""
    assert sum("MaterialBindingAPI is not applied" in record.getMessage() for record in caplog.records) == 1


# Stages by others and our own


def test_every_stage_by_others_reads(assets: Path) -> None:
    """Whatever is in a file, only our own errors leave the reader, and the scene holds together."""
    for path in stages_in(assets):
        try:
            reader = StageReader(open_stage(path))
            scene = reader.read(reader.first_frame())
        except DefshadeError:
            continue
        for drawable in scene.drawables:
            count = len(scene.meshes[drawable.mesh].triangles)
            assert sum(subset.count for subset in drawable.subsets) == count, path
            assert all(subset.material < len(scene.materials) for subset in drawable.subsets), path
        assert scene.lights and np.isfinite(scene.camera.world_from_camera).all(), path
        assert not any("__Prototype" in drawable.paths[0] for drawable in scene.drawables), path


def test_every_stage_of_ours_reads_without_a_remark(scenes: Path) -> None:
    for path in stages_in(scenes):
        reader = StageReader(open_stage(path))
        scene = reader.read(reader.first_frame())
        assert scene.drawables and scene.unsupported == (), path


def test_seven_thousand_instances_are_seven_drawables(assets: Path) -> None:
    stage = open_stage(assets / "maya_point_instancer_7k" / "PointInstancer_Grid_7k.usda")
    scene = StageReader(stage).read(None)
    assert len(scene.drawables) == 7
    assert len(positions(scene)) == len(set(positions(scene))) == 7000
