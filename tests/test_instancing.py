"""Native instances and PointInstancers: the same picture as if every copy stood on the stage by itself."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom, Vt
from stages import column_vectors, drawable_at, material_names, placed, positions, read, reasons, stage_of

from defshade_cli.scene.scene import Scene
from defshade_cli.usd.binding import NOTHING_BOUND, Bindings
from defshade_cli.usd.instancing import Piece, Placement, place
from defshade_cli.usd.reader import StageReader
from defshade_cli.usd.stage import open_stage

DEFAULT = Usd.TimeCode.Default()


def move(x: float = 0, y: float = 0, z: float = 0) -> str:
    return f'double3 xformOp:translate = ({x}, {y}, {z})\nuniform token[] xformOpOrder = ["xformOp:translate"]'


def instance(name: str, body: str = "", source: str = "tree") -> str:
    return f'def Xform "{name}" (\ninstanceable = true\ninherits = </{source}>\n) {{\n{body}\n}}\n'


TREE = f"""class Xform "tree" {{
    def Cube "trunk" {{
        {move(y=1)}
    }}
    def Xform "crown" {{
        float3 xformOp:scale = (2, 2, 2)
        float xformOp:rotateX = 30
        uniform token[] xformOpOrder = ["xformOp:scale", "xformOp:rotateX"]
        def Sphere "leaves" {{
            {move(z=3)}
        }}
    }}
}}
"""

# Native instances


def test_instances_stand_where_usd_says() -> None:
    stage = stage_of(f'{TREE}def Xform "wood" {{\n{move(10)}\n{instance("a", move(1))}{instance("b", move(2))}}}')
    scene = StageReader(stage).read(None)
    found = placed(scene)
    assert sorted(found) == [f"/wood/{tree}/{part}" for tree in "ab" for part in ("crown/leaves", "trunk")]
    for path, world_from_object in found.items():
        proxy = UsdGeom.Imageable(stage.GetPrimAtPath(path))
        np.testing.assert_allclose(world_from_object, column_vectors(proxy.ComputeLocalToWorldTransform(DEFAULT)))


def test_a_prototype_is_read_once() -> None:
    scene = read(TREE + "".join(instance(f"t{i}", move(i)) for i in range(50)))
    assert (len(scene.meshes), len(scene.drawables)) == (2, 2)
    trunk = drawable_at(scene, "/t7/trunk")
    assert trunk.instance_ids.tolist() == list(range(50))
    assert trunk.paths == tuple(f"/t{i}/trunk" for i in range(50))
    assert scene.meshes[trunk.mesh].path == "/t0/trunk", "no user has heard of /__Prototype_1"


def test_instances_of_instances() -> None:
    text = f'{TREE}class Xform "row" {{\n{instance("x", move(1))}{instance("y", move(2))}}}\n'
    stage = stage_of(text + instance("p", move(10), "row") + instance("q", move(20), "row"))
    scene = StageReader(stage).read(None)
    assert len(scene.meshes) == 2
    for path, world_from_object in placed(scene).items():
        proxy = UsdGeom.Imageable(stage.GetPrimAtPath(path))
        np.testing.assert_allclose(world_from_object, column_vectors(proxy.ComputeLocalToWorldTransform(DEFAULT)))
    assert len(placed(scene)) == 8


def test_an_instance_that_is_hidden_or_inactive_hides_nothing_else() -> None:
    text = TREE + instance("a", 'token visibility = "invisible"') + instance("b", move(5))
    text += instance("c").replace("instanceable", "active = false\ninstanceable")
    assert sorted(placed(read(text))) == ["/b/crown/leaves", "/b/trunk"]


def test_instances_hand_down_their_color() -> None:
    red, blue = (f"color3f[] primvars:displayColor = [{color}]" for color in ("(1, 0, 0)", "(0, 0, 1)"))
    group = f'def Xform "group" {{\n{blue}\nfloat[] primvars:displayOpacity = [0.5]\n{instance("c")}}}'
    text = TREE + instance("a", red) + instance("b") + group
    trunk = drawable_at(read(text), "/a/trunk")
    np.testing.assert_allclose(trunk.display_color, [[1, 0, 0], [0.18, 0.18, 0.18], [0, 0, 1]], rtol=1e-6)
    np.testing.assert_allclose(trunk.display_opacity, [1, 1, 0.5])


def test_a_color_inside_the_prototype_goes_before_the_instances() -> None:
    text = TREE.replace('def Cube "trunk" {', 'def Cube "trunk" {\ncolor3f[] primvars:displayColor = [(0, 1, 0)]')
    trunk = drawable_at(read(text + instance("a", "color3f[] primvars:displayColor = [(1, 0, 0)]")), "/a/trunk")
    np.testing.assert_allclose(trunk.display_color, [[0, 1, 0]])


MATERIALS = "".join(
    f"""def Material "{name}" {{
        token outputs:surface.connect = </{name}/s.outputs:surface>
        def Shader "s" {{
            uniform token info:id = "UsdPreviewSurface"
            token outputs:surface
        }}
    }}
    """
    for name in ("wood", "paint")
)


def bound(body: str, material: str, strength: str = "weakerThanDescendants") -> str:
    binding = f'rel material:binding = </{material}> (bindMaterialAs = "{strength}")'
    return body.replace("(\n", '(\nprepend apiSchemas = ["MaterialBindingAPI"]\n', 1).replace("{", f"{{\n{binding}", 1)


def test_instances_hand_down_their_material() -> None:
    scene = read(MATERIALS + TREE + bound(instance("a"), "wood") + bound(instance("b"), "paint") + instance("c"))
    assert material_names(scene, "/a/trunk") == ["/wood"]
    assert material_names(scene, "/b/trunk") == ["/paint"]
    assert material_names(scene, "/c/trunk") == ["<unbound>"]
    assert len(scene.meshes) == 2, "a prototype is read once, however its copies are bound"


@pytest.mark.parametrize(
    ("strength", "name"), [("weakerThanDescendants", "wood"), ("strongerThanDescendants", "paint")]
)
def test_bindings_of_instance_and_prototype_resolve_as_usd_does(strength: str, name: str) -> None:
    trunk = 'def Cube "trunk" (prepend apiSchemas = ["MaterialBindingAPI"]) {\nrel material:binding = </wood>'
    stage = stage_of(MATERIALS + TREE.replace('def Cube "trunk" {', trunk) + bound(instance("a"), "paint", strength))
    assert material_names(StageReader(stage).read(None), "/a/trunk") == [f"/{name}"]


@pytest.mark.parametrize("purposes", [("default",), ("default", "render"), ("default", "proxy"), ("guide",)])
def test_purposes_are_handed_down_as_usd_computes_them(purposes: tuple[str, ...]) -> None:
    text = TREE.replace('def Xform "crown" {', 'def Xform "crown" {\nuniform token purpose = "proxy"')
    guide = 'uniform token purpose = "guide"'
    stage = stage_of(
        f'def Cube "ground" {{\n}}\n{text}{instance("a")}{instance("b", guide)}def Cube "g" {{\n{guide}\n}}'
    )
    expected = {
        str(prim.GetPath())
        for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
        if prim.IsA(UsdGeom.Gprim) and UsdGeom.Imageable(prim).ComputePurposeInfo().purpose in purposes
    }
    assert set(placed(StageReader(stage, purposes=purposes).read(None))) == expected


def test_a_reset_stack_inside_a_prototype_stands_in_the_world() -> None:
    cube = """def Cube "trunk" {
        double3 xformOp:translate = (0, 7, 0)
        uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]"""
    text = TREE.replace('def Cube "trunk" {', cube).replace(move(y=1), "")
    found = placed(read(text + instance("a", move(1)) + instance("b", move(2))))
    for name in "ab":
        np.testing.assert_allclose(found[f"/{name}/trunk"][:3, 3], [0, 7, 0])


def test_animation_inside_a_prototype() -> None:
    text = TREE.replace(
        "double3 xformOp:translate = (0, 1, 0)",
        "double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (0, 10, 0) }",
    )
    reader = StageReader(stage_of(text + instance("a", move(1)) + instance("b", move(2))))
    first, later = reader.read(0), reader.read(5)
    np.testing.assert_allclose(placed(first)["/b/trunk"][:3, 3], [2, 0, 0])
    np.testing.assert_allclose(placed(later)["/b/trunk"][:3, 3], [2, 5, 0])
    assert first.meshes == later.meshes


def test_lights_inside_instances_shine_at_each() -> None:
    text = TREE.replace('def Cube "trunk" {', 'def SphereLight "lamp" {\n}\ndef Cube "trunk" {')
    scene = read(text + instance("a", move(1)) + instance("b", move(2)))
    assert {light.path: light.position.tolist() for light in scene.lights} == {
        "/a/lamp": [1, 0, 0],
        "/b/lamp": [2, 0, 0],
    }


# PointInstancers


def instancer(arrays: str, prototypes: str = "<cube>", below: str = 'def Cube "cube" {\n}', name: str = "swarm") -> str:
    targets = prototypes.replace("<", f"</{name}/")
    return f'def PointInstancer "{name}" {{\n{arrays}\nrel prototypes = [{targets}]\n{below}\n}}\n'


THREE = "point3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0)]\nint[] protoIndices = [0, 0, 0]"


def ids(scene: Scene) -> list[int]:
    (drawable,) = scene.drawables
    return drawable.instance_ids.tolist()


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


# Placing

numbers = st.floats(-10, 10)
matrix_lists = st.lists(st.lists(numbers, min_size=16, max_size=16), min_size=1, max_size=4)
stacks = matrix_lists.map(lambda rows: np.array(rows).reshape(-1, 4, 4))
colors = st.sampled_from([np.nan, 0.0, 0.25, 1.0])


def _arrays(count: int, draw: Callable) -> tuple[NDArray, NDArray, NDArray]:
    rows = np.array(draw(st.lists(colors, min_size=count, max_size=count)), np.float32)
    return np.arange(count, dtype=np.int32), np.repeat(rows[:, None], 3, axis=1), rows


@given(stacks, stacks, st.data())
def test_placing_is_the_loop_over_copies_and_instances(inner: NDArray, outer: NDArray, data: st.DataObject) -> None:
    numbered, color, opacity = _arrays(len(inner), data.draw)
    piece = Piece(None, inner, tuple(f"/p/{i}" for i in numbered), numbered, color, opacity, None, (NOTHING_BOUND,))  # type: ignore[arg-type]
    numbered, color, opacity = _arrays(len(outer), data.draw)
    roots = tuple(f"/q{i}" for i in numbered)
    (found,) = place([piece], Placement(outer, numbered, color, opacity, "render", Bindings(), False, "/p", roots))
    row = 0
    for copy in range(len(outer)):
        for instance in range(len(inner)):
            np.testing.assert_allclose(found.root_from_object[row], outer[copy] @ inner[instance])
            assert found.paths[row] == f"/q{copy}/{instance}"
            assert found.ids[row] == copy
            own = piece.display_opacity[instance]
            expected = opacity[copy] if np.isnan(own) else own
            np.testing.assert_equal(found.display_opacity[row], expected)
            np.testing.assert_equal(found.display_color[row], np.full(3, expected))
            row += 1
    assert row == len(found.root_from_object) and found.purpose == "render"
