"""Native instances, and placing in general: the same picture as if every copy stood on the stage by itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.usd.instancing.instancing import Piece, Placement, place
from defshade_cli.usd.materials.bindings import NOTHING_BOUND, Bindings
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader
from stages import (
    MATERIALS,
    TREE,
    bound,
    column_vectors,
    drawable_at,
    instance,
    material_names,
    move,
    placed,
    read,
    stage_of,
)

DEFAULT = Usd.TimeCode.Default()


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


def material_of(primvar: str) -> str:
    """A material of the primvar's name, of which its colour is."""
    return f"""def Material "{primvar}" {{
        token outputs:surface.connect = </{primvar}/s.outputs:surface>
        def Shader "s" {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </{primvar}/r.outputs:result>
            token outputs:surface
        }}
        def Shader "r" {{
            uniform token info:id = "UsdPrimvarReader_float3"
            string inputs:varname = "{primvar}"
            float3 outputs:result
        }}
    }}
    """


TWO_COLORS = """def Cube "trunk" {
    color3f[] primvars:displayColor = [(1, 0, 0)]
    color3f[] primvars:paint = [(0, 0, 1)]
}"""


def test_a_material_outside_finds_its_colour_inside_the_prototype() -> None:
    """As if each stood by itself: a bare instance, one that wears it, one inside that, one whose own is beaten."""
    text = material_of("paint") + material_of("displayColor")
    text += f'class Xform "tree" {{\n{TWO_COLORS}\n}}\nclass Xform "grove" {{\n{instance("one")}}}\n'
    text += bound(f'class Xform "blue" (\n) {{\n{TWO_COLORS}\n}}\n', "paint")
    text += instance("bare") + bound(instance("worn"), "paint") + bound(instance("grown", source="grove"), "paint")
    text += bound(instance("over", source="blue"), "displayColor", "strongerThanDescendants")
    red, blue = [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]
    found = {p: c for d in read(text).drawables for p, c in zip(d.paths, d.display_color.tolist(), strict=True)}
    assert found == {"/bare/trunk": red, "/worn/trunk": blue, "/grown/one/trunk": blue, "/over/trunk": red}


def test_a_color_inside_the_prototype_goes_before_the_instances() -> None:
    text = TREE.replace('def Cube "trunk" {', 'def Cube "trunk" {\ncolor3f[] primvars:displayColor = [(0, 1, 0)]')
    trunk = drawable_at(read(text + instance("a", "color3f[] primvars:displayColor = [(1, 0, 0)]")), "/a/trunk")
    np.testing.assert_allclose(trunk.display_color, [[0, 1, 0]])


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


@pytest.mark.parametrize(
    "members",
    [
        "rel collection:some:includes = [</wood_lot/a/trunk>, </wood_lot/b/crown>]",
        'uniform pathExpression collection:some:membershipExpression = "/wood_lot/a/trunk //inner//leaves"',
        "rel collection:some:includes = [</wood_lot/b>]",
    ],
)
def test_collections_bind_what_is_inside_instances(members: str) -> None:
    """As the same stage has it without instances, nested ones too; each mesh is still read once."""
    trees = instance("a") + instance("b", move(5)) + instance("c", source="lot")
    text = f"""{MATERIALS}{TREE}class Xform "lot" {{
        {instance("inner")}
    }}
    def Xform "wood_lot" (prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:some"]) {{
        {members}
        rel material:binding = </wood>
        rel material:binding:collection:some = [</wood_lot.collection:some>, </paint>]
        {trees}
    }}"""
    shared, alone = read(text), read(text.replace("instanceable = true", ""))
    paths = sorted(placed(alone))
    assert sorted(placed(shared)) == paths
    assert [material_names(shared, path) for path in paths] == [material_names(alone, path) for path in paths]
    assert {name for path in paths for name in material_names(shared, path)} == {"/wood", "/paint"}
    assert len(shared.meshes) == 2


def test_collections_of_a_prototype_leave_each_instance_its_own_material() -> None:
    """What no collection of the prototype holds, is bound as the outer instances are."""
    row = f"""class Xform "lot" {{
        def Xform "row" (prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:some"]) {{
            rel collection:some:includes = [</lot/row/inner/crown>]
            rel material:binding:collection:some = [</lot/row.collection:some>, </metal>]
            {instance("inner")}
        }}
    }}
    def Material "metal" {{
    }}
    """
    lots = bound(instance("a", source="lot"), "wood") + bound(instance("b", source="lot"), "paint")
    scene = read(MATERIALS + TREE + row + lots)
    for lot, name in (("a", "/wood"), ("b", "/paint")):
        assert material_names(scene, f"/{lot}/row/inner/trunk") == [name]
        assert material_names(scene, f"/{lot}/row/inner/crown/leaves") == ["/metal"]


def test_collections_bind_what_is_inside_later_instances() -> None:
    """The instance that comes first has all that the second has, but for the collection above it."""
    text = f"""{MATERIALS}{TREE}{instance("a")}
    def Xform "wood_lot" (prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:some"]) {{
        rel collection:some:includes = [</wood_lot/b/trunk>]
        rel material:binding:collection:some = [</wood_lot.collection:some>, </paint>]
        {instance("b")}
    }}"""
    scene = read(text)
    assert material_names(scene, "/a/trunk") == ["<unbound>"]
    assert material_names(scene, "/wood_lot/b/trunk") == ["/paint"]


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
    assert set(placed(StageReader(stage, ReadOptions(purposes=purposes)).read(None))) == expected


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
    piece = Piece(
        None, inner, tuple(f"/p/{i}" for i in numbered), numbered, color, opacity, None, {"/p": NOTHING_BOUND}
    )  # type: ignore[arg-type]
    numbered, color, opacity = _arrays(len(outer), data.draw)
    roots = tuple(f"/q{i}" for i in numbered)
    (found,) = place([piece], Placement(outer, numbered, color, opacity, "render", Bindings(), False, "/p", roots))
    row = 0
    for copy in range(len(outer)):
        for place_inside in range(len(inner)):
            np.testing.assert_allclose(found.root_from_object[row], outer[copy] @ inner[place_inside])
            assert found.paths[row] == f"/q{copy}/{place_inside}"
            assert found.ids[row] == copy
            own = piece.display_opacity[place_inside]
            expected = opacity[copy] if np.isnan(own) else own
            np.testing.assert_equal(found.display_opacity[row], expected)
            np.testing.assert_equal(found.display_color[row], np.full(3, expected))
            row += 1
    assert row == len(found.root_from_object) and found.purpose == "render"
