"""PointInstancers: copies where USD puts them, masked, coloured and bound as the schema says."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, Vt

from defshade_cli.scene.scene import Scene
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.reader import StageReader
from stages import (
    MATERIALS,
    TREE,
    bound,
    column_vectors,
    instance,
    material_names,
    move,
    placed,
    positions,
    read,
    reasons,
    stage_of,
)

DEFAULT = Usd.TimeCode.Default()


def instancer(arrays: str, prototypes: str = "<cube>", below: str = 'def Cube "cube" {\n}', name: str = "swarm") -> str:
    targets = prototypes.replace("<", f"</{name}/")
    return f'def PointInstancer "{name}" {{\n{arrays}\nrel prototypes = [{targets}]\n{below}\n}}\n'


THREE = "point3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0)]\nint[] protoIndices = [0, 0, 0]"


def ids(scene: Scene) -> list[int]:
    (drawable,) = scene.drawables
    return drawable.instance_ids.tolist()


@pytest.mark.parametrize(
    ("array", "name", "length"),
    [
        ("float3[] scales = [(1, 1, 1), (9, 9, 9)]", "scales", 2),
        ("quath[] orientations = [(0, 1, 0, 0)]", "orientations", 1),
        ("quatf[] orientationsf = [(0, 1, 0, 0), (0, 1, 0, 0), (0, 1, 0, 0), (1, 0, 0, 0)]", "orientationsf", 4),
    ],
)
def test_an_array_of_another_length_is_left_out(array: str, name: str, length: int) -> None:
    """Of what fits nothing is lost: the others of the two still count."""
    fitting = (
        "float3[] scales = [(2, 2, 2), (2, 2, 2), (2, 2, 2)]"
        if name != "scales"
        else "quath[] orientations = [(0, 0, 1, 0), (0, 0, 1, 0), (0, 0, 1, 0)]"
    )
    scene = read(instancer(f"{THREE}\n{fitting}\n{array}"))
    (drawn,) = scene.drawables
    np.testing.assert_array_equal(drawn.world_from_object[:, 0, 3], [0, 1, 2])
    expected = np.diag([-1, 1, -1]) if name == "scales" else 2 * np.eye(3)
    np.testing.assert_allclose(drawn.world_from_object[:, :3, :3], np.tile(expected, (3, 1, 1)), atol=1e-6)
    assert f"{name} is left out: {length} values where 3 are due" in reasons(scene, "/swarm")


def test_copies_stand_where_usd_says() -> None:
    """Prototype's own transform, scale, rotation, position, the instancer's transform: in that order."""
    rng = np.random.default_rng(1)
    stage = stage_of("")
    UsdGeom.Xform.Define(stage, "/top").AddRotateYOp().Set(40)
    schema = UsdGeom.PointInstancer.Define(stage, "/top/swarm")
    schema.AddTranslateOp().Set((1, 2, 3))
    for name in ("a", "b"):
        prototype = UsdGeom.Cube.Define(stage, f"/top/swarm/{name}")
        prototype.AddRotateXYZOp().Set((10, 20, 30))
        prototype.AddTranslateOp().Set((0, 0, 5))
        schema.GetPrototypesRel().AddTarget(prototype.GetPath())
    turns = rng.normal(size=(8, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    schema.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(rng.normal(size=(8, 3)).astype(np.float32)))
    schema.CreateScalesAttr(Vt.Vec3fArray.FromNumpy(rng.uniform(0.5, 2, (8, 3)).astype(np.float32)))
    schema.CreateOrientationsAttr(Vt.QuathArray([Gf.Quath(*map(float, turn)) for turn in turns]))
    schema.CreateProtoIndicesAttr([0, 1, 1, 0, 0, 1, 0, 1])
    to_world = schema.ComputeLocalToWorldTransform(DEFAULT)
    expected = [column_vectors(m * to_world) for m in schema.ComputeInstanceTransformsAtTime(DEFAULT, DEFAULT)]
    found = placed(StageReader(stage).read(None))
    for row, prototype in enumerate("abbaabab"):
        np.testing.assert_allclose(found[f"/top/swarm/{prototype}#{row}"], expected[row], atol=1e-12)


@pytest.mark.parametrize(
    ("mask", "left"),
    [
        ("", [0, 1, 2]),
        ("int64[] invisibleIds = [1]", [0, 2]),
        ("int64[] ids = [7, 8, 9]\nint64[] invisibleIds = [8]", [7, 9]),
        ("int64[] ids = [-5, 0, 5]", [-5, 0, 5]),
        ("int64[] ids = [5000000000, 1, 2]", [0, 1, 2]),
    ],
)
def test_masks_and_ids(mask: str, left: list[int]) -> None:
    assert ids(read(instancer(f"{THREE}\n{mask}"))) == left


def test_inactive_ids() -> None:
    text = instancer(THREE).replace('"swarm" {', '"swarm" (\ninactiveIds = [0, 2]\n) {')
    assert ids(read(text)) == [1]


def test_masks_vary_over_time(assets: Path) -> None:
    reader = StageReader(open_stage(assets / "ousd_point_instancer_a" / "pi_masking.usda"))
    drawn = [[round(x) for x, _, _ in positions(reader.read(frame))] for frame in range(5)]
    assert drawn == [[-6, -3, 0, 6], [-3, 0, 6], [-6, 0, 3], [-6, 0, 3, 6], [-6, -3, 0, 6]]


def test_velocities_carry_copies_between_samples() -> None:
    arrays = """int[] protoIndices = [0]
        point3f[] positions.timeSamples = { 0: [(0, 0, 0)], 24: [(100, 0, 0)] }
        vector3f[] velocities.timeSamples = { 0: [(0, 12, 0)], 24: [(0, 0, 0)] }"""
    assert positions(read(instancer(arrays), 12.0)) == [(0, 6, 0)]


def test_positions_are_interpolated_without_velocities() -> None:
    arrays = "int[] protoIndices = [0]\npoint3f[] positions.timeSamples = { 0: [(0, 0, 0)], 24: [(100, 0, 0)] }"
    assert positions(read(instancer(arrays), 12.0)) == [(50, 0, 0)]


@pytest.mark.parametrize("holder", ['def Scope "p"', 'class "p"', 'over "p"', 'def Scope "p" (\nactive = true\n)'])
def test_prototypes_hide_under_any_specifier(holder: str) -> None:
    below = f'{holder} {{\ndef Xform "tree" {{\ndef Cube "trunk" {{\n}}\n}}\n}}'
    scene = read(instancer(THREE, "<p/tree>", below))
    assert len(placed(scene)) == 3
    assert scene.drawables[0].paths == ("/swarm/p/tree/trunk",)


def test_a_prototype_outside_is_drawn_in_both_places() -> None:
    outside = f'def Xform "cube" {{\n{move(0, 5)}\ndef Cube "c" {{\n}}\n}}\n'
    text = outside + instancer(THREE, "<x>", "").replace("</swarm/x>", "</cube>")
    assert positions(read(text)) == [(0, 5, 0), (0, 5, 0), (1, 5, 0), (2, 5, 0)]


def test_what_stands_above_a_prototype_neither_moves_nor_hides_it() -> None:
    below = f'def Xform "p" {{\ntoken visibility = "invisible"\n{move(0, 99)}\ndef Cube "cube" {{\n}}\n}}'
    assert positions(read(instancer(THREE, "<p/cube>", below))) == [(0, 0, 0), (1, 0, 0), (2, 0, 0)]


def test_an_invisible_prototype_is_not_drawn() -> None:
    below = 'def Cube "a" {\ntoken visibility = "invisible"\n}\ndef Cube "b" {\n}'
    text = instancer(THREE.replace("[0, 0, 0]", "[0, 1, 1]"), "<a>, <b>", below)
    assert positions(read(text)) == [(1, 0, 0), (2, 0, 0)]


def test_instancers_in_instancers() -> None:
    inner = instancer("point3f[] positions = [(0, 1, 0), (0, 2, 0)]\nint[] protoIndices = [0, 0]", name="inner")
    text = instancer(THREE, "<inner>", inner).replace("</inner/", "</swarm/inner/")
    scene = read(text)
    assert positions(scene) == [(x, y, 0) for x in range(3) for y in (1, 2)]
    assert len(scene.meshes) == len(scene.drawables) == 1
    assert scene.drawables[0].instance_ids.tolist() == [0, 0, 1, 1, 2, 2], "the outermost instance counts"


def test_a_native_instance_as_prototype() -> None:
    below = instance("tree", move(0, 4))
    scene = read(TREE + instancer(THREE, "<tree>", below))
    found = placed(scene)
    assert sorted(found) == [f"/swarm/tree/{part}#{i}" for part in ("crown/leaves", "trunk") for i in range(3)]
    np.testing.assert_allclose(found["/swarm/tree/trunk#2"][:3, 3], [2, 5, 0])


def test_an_instancer_inside_native_instances() -> None:
    text = 'class Xform "tree" {\n' + instancer(THREE).replace("</swarm/", "</tree/swarm/") + "}\n"
    scene = read(text + instance("a", move(0, 1)) + instance("b", move(0, 2)))
    assert positions(scene) == [(x, y, 0) for x in range(3) for y in (1, 2)]
    (drawable,) = scene.drawables
    assert Counter(drawable.paths) == {"/a/swarm/cube": 3, "/b/swarm/cube": 3}
    assert drawable.instance_ids.tolist() == [0, 0, 0, 1, 1, 1]


@pytest.mark.parametrize(
    ("primvar", "colors"),
    [
        ("[(1, 0, 0)]", [(1, 0, 0)] * 3),
        ('[(1, 0, 0), (0, 1, 0), (0, 0, 1)] (interpolation = "varying")', [(1, 0, 0), (0, 1, 0), (0, 0, 1)]),
        ('[(1, 0, 0), (0, 1, 0), (0, 0, 1)] (interpolation = "vertex")', [(1, 0, 0), (0, 1, 0), (0, 0, 1)]),
    ],
)
def test_copies_take_the_instancers_colors(primvar: str, colors: list[tuple[float, ...]]) -> None:
    scene = read(instancer(f"{THREE}\nint64[] invisibleIds = [0]\ncolor3f[] primvars:displayColor = {primvar}"))
    np.testing.assert_allclose(scene.drawables[0].display_color, colors[1:])


def test_materials_come_from_where_the_prototype_stands_else_from_the_instancer() -> None:
    below = """def Scope "p" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        rel material:binding = </wood>
        def Cube "a" {
        }
    }"""
    text = instancer(THREE, "<p/a>, <b>", below).replace("</swarm/b>", "</b>").replace("[0, 0, 0]", "[0, 1, 1]")
    text = text.replace('"swarm" {', '"swarm" (\n) {')
    scene = read(f'{MATERIALS}def Cube "b" {{\n}}\n' + bound(text, "paint"))
    assert material_names(scene, "/swarm/p/a") == ["/wood"]
    alone, copies = (drawable for drawable in scene.drawables if drawable.paths == ("/b",))
    assert scene.materials[alone.subsets[0].material].path == "<unbound>"
    assert scene.materials[copies.subsets[0].material].path == "/paint"


def test_lights_as_prototypes() -> None:
    scene = read('def Cube "c" {\n}\n' + instancer(THREE, "<lamp>", f'def SphereLight "lamp" {{\n{move(0, 1)}\n}}'))
    assert sorted(light.position.tolist() for light in scene.lights) == [[0, 1, 0], [1, 1, 0], [2, 1, 0]]
    assert {light.path for light in scene.lights} == {"/swarm/lamp"}


@pytest.mark.parametrize(
    ("arrays", "reason", "left"),
    [
        (THREE.replace("[0, 0, 0]", "[0, 5, -1]"), "2 instances have a protoIndex without prototype", 1),
        (THREE.replace("(1, 0, 0)", "(nan, 0, 0)"), "1 instances have a transform that is not finite", 2),
        (THREE.replace("[0, 0, 0]", "[0, 0]"), "positions and protoIndices differ in length", 0),
    ],
)
def test_broken_arrays_are_reported(arrays: str, reason: str, left: int) -> None:
    scene = read('def Sphere "s" {\n}\n' + instancer(arrays))
    assert reasons(scene, "/swarm") == [reason]
    assert len(placed(scene)) == 1 + left


def test_a_missing_prototype_is_reported() -> None:
    scene = read('def Sphere "s" {\n}\n' + instancer(THREE, "<gone>"))
    assert reasons(scene, "/swarm") == ["there is no prototype /swarm/gone"]


def test_an_instancer_of_itself_is_reported_and_ends() -> None:
    below = instancer(THREE, "<x>", "", "inner").replace("</inner/x>", "</swarm/group>")
    text = instancer(THREE, "<group>", f'def Xform "group" {{\ndef Cube "cube" {{\n}}\n{below}\n}}')
    scene = read(text)
    assert reasons(scene, "/swarm/group/inner") == ["it is part of its own prototype"]
    assert len(placed(scene)) == 3


def test_an_instancer_without_copies_for_now_is_no_empty_stage() -> None:
    arrays = """int[] protoIndices.timeSamples = { 0: [], 1: [0] }
        point3f[] positions.timeSamples = { 0: [], 1: [(0, 0, 0)] }"""
    reader = StageReader(stage_of(instancer(arrays)))
    assert [len(reader.read(frame).drawables) for frame in (0, 1)] == [0, 1]


def test_velocities_without_a_rate_are_reported() -> None:
    arrays = """int[] protoIndices = [0]
        point3f[] positions.timeSamples = { 0: [(0, 0, 0)], 24: [(100, 0, 0)] }
        vector3f[] velocities.timeSamples = { 0: [(0, 12, 0)], 24: [(0, 0, 0)] }"""
    scene = read('def Sphere "s" {\n}\n' + instancer(arrays), 12.0, "timeCodesPerSecond = 0")
    assert reasons(scene, "/swarm") == ["1 instances have a transform that is not finite"]
