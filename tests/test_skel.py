"""Skinning, blend shapes and their bindings, against UsdSkel's own figures and closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdSkel, Vt
from scipy.spatial.transform import Rotation

from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader
from defshade_cli.usd.skel.influences import Influences
from defshade_cli.usd.skel.skinning import DualQuaternionBlend, LinearBlend
from rigs import animation, moulded, rig, shape, triangle, world_points
from stages import instance, move, read, reasons, stage_of

METHODS = {"classicLinear": LinearBlend, "dualQuaternion": DualQuaternionBlend}

FLOAT_NOISE = 2e-6
"""Of the size of what is deformed: USD skins in float32, we in float64."""

BENT = [(-1, 1, 0), (-1, 2, 0), (-2, 1, 0)]
"""The triangle when its joint, a unit above the origin, has turned by 90° about z."""


BENT_RIGHT = [(6, 1, 0), (6, 0, 0), (7, 1, 0)]
"""By −90°, 5 units aside."""


# Against UsdSkel


def _random_joints(rng: np.random.Generator, count: int, scaled: bool) -> np.ndarray:
    joints = np.tile(np.eye(4), (count, 1, 1))
    joints[:, :3, :3] = Rotation.random(count, random_state=1).as_matrix()
    joints[:, :3, 3] = rng.normal(size=(count, 3))
    if scaled:
        joints[:, :3, :3] *= rng.uniform(0.5, 2.0, (count, 1, 3))
    return joints


def _random_influences(rng: np.random.Generator, points: int, joints: int, most: int) -> Influences:
    weights = rng.dirichlet(np.ones(most), points)
    return Influences(rng.integers(0, joints, (points, most)), weights.astype(np.float32).astype(float), joints)


@pytest.mark.parametrize("scaled", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_points_and_normals_are_usds(method: str, scaled: bool) -> None:
    rng = np.random.default_rng(3)
    joints, influences = _random_joints(rng, 7, scaled), _random_influences(rng, 200, 7, 4)
    points = rng.normal(size=(200, 3)).astype(np.float32)
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    indices, weights = (
        Vt.IntArray(influences.joints.ravel().tolist()),
        Vt.FloatArray(influences.weights.ravel().tolist()),
    )
    expected = Vt.Vec3fArray.FromNumpy(points.copy())
    gf = [Gf.Matrix4d(joint.T.tolist()) for joint in joints]
    UsdSkel.SkinPoints(method, Gf.Matrix4d(1), Vt.Matrix4dArray(gf), indices, weights, 4, expected)
    skinning = METHODS[method](joints)
    np.testing.assert_allclose(skinning.points(points.astype(float), influences), expected, atol=1e-5)

    turned = Vt.Vec3fArray.FromNumpy(normals.copy())
    inverse_transposes = [Gf.Matrix3d(np.linalg.inv(j[:3, :3]).tolist()) for j in joints]
    UsdSkel.SkinNormals(method, Gf.Matrix3d(1), Vt.Matrix3dArray(inverse_transposes), indices, weights, 4, turned)
    ours = skinning.normals(normals.astype(float), influences)
    np.testing.assert_allclose(ours / np.linalg.norm(ours, axis=1, keepdims=True), turned, atol=1e-5)


def test_the_skinned_arm_is_its_baked_twin(assets: Path) -> None:
    skinned, baked = (
        StageReader(open_stage(assets / "ousd_skel_a/UsdSkel" / name), ReadOptions(complexity="low"))
        for name in ("arm.usda", "arm_baked.usda")
    )
    for frame in (1, 3, 7, 10):
        (ours,), (theirs,) = (world_points(reader.read(frame)).values() for reader in (skinned, baked))
        assert np.abs(ours - theirs).max() < 1e-4 * np.ptp(theirs, axis=0).max()


@pytest.mark.parametrize(
    ("name", "frames"),
    [
        ("ousd_skel_a/SkelBlendShapes/blendshapes.usda", (1, 2, 3)),
        ("arnold_skel_1426/test_1426/data/test.usda", (101, 110)),
        ("tiny_blender_exports_a/blendshape-and-animation-test-001.usda", (1, 10, 20)),
        ("wg_cesium_man/CesiumMan.usdz", (0, 10)),
        ("scenes/skinning.usda", (1, 24)),
        ("scenes/skinning_instances.usda", (1, 24)),
        ("scenes/blend_shapes.usda", (1, 24)),
    ],
)
def test_stages_are_as_usd_bakes_them(name: str, frames: tuple[int, ...], request: pytest.FixtureRequest) -> None:
    ours = name.startswith("scenes/")
    path = request.getfixturevalue("scenes" if ours else "assets") / name.removeprefix("scenes/")
    baked = Usd.Stage.Open(str(path), Usd.Stage.LoadAll)
    baked.SetEditTarget(baked.GetSessionLayer())
    for prim in list(baked.Traverse()):
        if prim.IsA(UsdSkel.Root):
            prim.SetInstanceable(False)
            assert UsdSkel.BakeSkinning(UsdSkel.Root(prim), Gf.Interval(min(frames), max(frames)))
    readers = [StageReader(stage, ReadOptions(complexity="low")) for stage in (open_stage(path), baked)]
    for frame in frames:
        found, expected = (world_points(reader.read(frame)) for reader in readers)
        assert found.keys() == expected.keys()
        size = np.ptp(np.concatenate(list(expected.values())), axis=0).max()
        for prim in expected:
            np.testing.assert_allclose(found[prim], expected[prim], atol=FLOAT_NOISE * size)


def test_blend_shapes_are_the_truth_that_the_stage_carries(assets: Path) -> None:
    """The baked mesh stands beside the deformed one, 12 units away."""
    reader = StageReader(open_stage(assets / "ousd_skel_a/SkelBlendShapes/blendshapes.usda"))
    for frame in (1, 2, 3):
        points = world_points(reader.read(frame))
        moved = points["/TestPlane/Mesh"] + (12, 0, 0)
        # Its arrays were written with about four digits.
        np.testing.assert_allclose(moved, points["/GroundTruth/Mesh"], atol=2e-4)


# Closed forms


def test_half_way_between_two_rotations_is_half_the_angle() -> None:
    """Where linear blending collapses to a point, dual quaternions keep the distance to the axis."""
    joints = np.tile(np.eye(4), (2, 1, 1))
    joints[1, :3, :3] = Rotation.from_euler("y", 179.0, degrees=True).as_matrix()
    influences = Influences(np.array([[0, 1]]), np.array([[0.5, 0.5]]), 2)
    point = np.array([[1.0, 5.0, 0.0]])
    half = Rotation.from_euler("y", 89.5, degrees=True).apply(point)
    np.testing.assert_allclose(DualQuaternionBlend(joints).points(point, influences), half, atol=1e-12)
    assert np.hypot(*LinearBlend(joints).points(point, influences)[0, [0, 2]]) < 0.01


def test_half_way_between_two_places_is_half_a_screw() -> None:
    """Rotation by θ about z through (1, 0): half way it is by θ/2 about the same axis."""

    def about(degrees: float) -> np.ndarray:
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
        turn[:3, 3] = (1, 0, 0) - turn[:3, :3] @ (1, 0, 0)
        return turn

    joints = np.stack([about(0.0), about(120.0)])
    influences = Influences(np.array([[0, 1]]), np.array([[0.5, 0.5]]), 2)
    moved = DualQuaternionBlend(joints).points(np.array([[3.0, 0.0, 0.0]]), influences)
    np.testing.assert_allclose(moved[0], (about(60.0) @ (3, 0, 0, 1))[:3], atol=1e-12)


def test_opposite_quaternions_blend_to_the_rotation_that_they_are() -> None:
    """Rotations by 170° and 190° have quaternions on opposite hemispheres once they are made canonical."""
    joints = np.tile(np.eye(4), (2, 1, 1))
    joints[:, :3, :3] = Rotation.from_euler("z", [[170.0], [190.0]], degrees=True).as_matrix()
    influences = Influences(np.array([[0, 1]]), np.array([[0.5, 0.5]]), 2)
    moved = DualQuaternionBlend(joints).points(np.array([[1.0, 0.0, 0.0]]), influences)
    np.testing.assert_allclose(moved, [[-1.0, 0.0, 0.0]], atol=1e-12)


# Bindings


@pytest.mark.parametrize("interpolation", ["constant", "vertex"])
def test_a_joint_moves_what_is_bound_to_it(interpolation: str) -> None:
    scene = read(rig(animation("anim", (0, 90)) + triangle(interpolation=interpolation), "anim"))
    np.testing.assert_allclose(world_points(scene)["/rig/mesh"], BENT, atol=1e-6)
    assert scene.unsupported == ()


def test_the_skeletons_place_counts_and_the_meshs_does_not() -> None:
    text = rig(animation("anim", (0, 90)) + triangle(interpolation="vertex", extra=move(x=100)), "anim")
    text = f'def Xform "up" {{\n{move(y=10)}\n{text}\n}}'
    np.testing.assert_allclose(world_points(read(text))["/up/rig/mesh"], np.add(BENT, (0, 10, 0)), atol=1e-6)


def test_the_bind_transform_takes_points_to_the_bind_pose() -> None:
    bind = "matrix4d primvars:skel:geomBindTransform = ((2, 0, 0, 0), (0, 2, 0, 0), (0, 0, 2, 0), (0, 1, 0, 1))"
    for interpolation in ("constant", "vertex"):
        scene = read(rig(animation("anim", (0, 90)) + triangle("mesh", 1, interpolation, bind), "anim"))
        expected = [(-4, 1, 0), (-4, 3, 0), (-6, 1, 0)]
        np.testing.assert_allclose(world_points(scene)["/rig/mesh"], expected, atol=1e-6)


def test_a_prim_may_order_joints_in_its_own_way() -> None:
    order = 'uniform token[] skel:joints = ["root/bend", "root"]'
    scene = read(rig(animation("anim", (0, 90)) + triangle("mesh", 0, "vertex", order), "anim"))
    np.testing.assert_allclose(world_points(scene)["/rig/mesh"], BENT, atol=1e-6)


def test_a_rigid_prim_moves_without_changing() -> None:
    cube = triangle("cube").replace("def Mesh", "def Cube")
    reader = StageReader(stage_of(rig(animation("anim", (0, 0), (10, 90)) + triangle() + cube, "anim")))
    first, last = reader.read(0), reader.read(10)
    assert all(a is b for a, b in zip(first.meshes, last.meshes, strict=True))
    np.testing.assert_allclose(world_points(last)["/rig/mesh"], BENT, atol=1e-6)
    np.testing.assert_allclose(last.drawables[1].world_from_object[0] @ (0, 3, 0, 1), (-2, 1, 0, 1), atol=1e-6)


def test_a_mesh_whose_pose_stays_is_the_same_object() -> None:
    body = animation("anim", (0, 0), (10, 0), (20, 90)) + triangle(interpolation="vertex")
    reader = StageReader(stage_of(rig(body, "anim")))
    first, second, third = (reader.read(frame).meshes[0] for frame in (0, 5, 15))
    assert first is second
    assert second is not third


def test_normals_turn_with_their_joint() -> None:
    face_varying = """normal3f[] primvars:normals = [(1, 0, 0), (0, 1, 0), (0, 0, 1)] (
        interpolation = "faceVarying"
    )"""
    vertex = face_varying.replace("faceVarying", "vertex")
    for normals in (face_varying, vertex):
        scene = read(rig(animation("anim", (0, 90)) + triangle("mesh", 1, "vertex", normals), "anim"))
        np.testing.assert_allclose(scene.meshes[0].normals, [(0, 1, 0), (-1, 0, 0), (0, 0, 1)], atol=1e-6)


def test_nothing_is_skinned_outside_a_skel_root() -> None:
    scene = read(rig(animation("anim", (0, 90)) + triangle(interpolation="vertex"), "anim", kind="Xform"))
    np.testing.assert_allclose(world_points(scene)["/rig/mesh"][0], (0, 2, 0))
    assert scene.unsupported == (), "baked stages keep their influences"


# Instances

CLASS = rig(triangle(interpolation="vertex")).replace("def SkelRoot", "class SkelRoot")
SOURCES = animation("left", (0, 90)) + animation("right", (0, -90))


def _bound(name: str, x: float, source: str) -> str:
    text = instance(name, f"rel skel:animationSource = </{source}>\n{move(x=x)}", "rig").replace("Xform", "SkelRoot")
    return text.replace("(\n", '(\nprepend apiSchemas = ["SkelBindingAPI"]\n', 1)


def test_instances_deform_as_the_animation_that_each_inherits() -> None:
    scene = read(CLASS + SOURCES + _bound("a", 0, "left") + _bound("b", 5, "right") + _bound("c", 10, "left"))
    points = world_points(scene)
    np.testing.assert_allclose(points["/a/mesh"], BENT, atol=1e-6)
    np.testing.assert_allclose(points["/b/mesh"], BENT_RIGHT, atol=1e-6)
    np.testing.assert_allclose(points["/c/mesh"], np.add(BENT, (10, 0, 0)), atol=1e-6)
    assert len(scene.meshes) == 2
    assert sorted(len(drawable.paths) for drawable in scene.drawables) == [1, 2]


def test_skel_roots_inside_instances_inherit_too() -> None:
    nested = CLASS.replace('class SkelRoot "rig" {', 'class Xform "outer" {\ndef SkelRoot "rig" {') + "}\n"
    instances = [
        _bound(*args).replace("/rig>", "/outer>").replace("SkelRoot", "Xform")
        for args in (("a", 0, "left"), ("b", 5, "right"))
    ]
    points = world_points(read(nested + SOURCES + "".join(instances)))
    np.testing.assert_allclose(points["/a/rig/mesh"], BENT, atol=1e-6)
    np.testing.assert_allclose(points["/b/rig/mesh"][0], (6, 1, 0), atol=1e-6)


def test_a_skeleton_above_instances_moves_each() -> None:
    unbound = triangle(interpolation="vertex").replace("rel skel:skeleton = <../skeleton>", "")
    part = f'class Xform "part" {{\n{unbound}\n}}\n'
    body = animation("anim", (0, 90)) + "rel skel:skeleton = <skeleton>\n"
    body += "".join(instance(name, source="part") for name in "ab")
    points = world_points(
        read(part + rig(body, "anim").replace('"rig" {', '"rig" (prepend apiSchemas = ["SkelBindingAPI"]) {', 1))
    )
    for name in "ab":
        np.testing.assert_allclose(points[f"/rig/{name}/mesh"], BENT, atol=1e-6)


# Blend shapes


def test_blend_shapes_add_up() -> None:
    text = moulded(
        "[0.5, 2]",
        shape("up", "[(0, 2, 0), (0, 2, 0), (0, 2, 0)]"),
        shape("out", "[(0, 0, 3)]", "uniform int[] pointIndices = [1]"),
        names=("up", "out"),
    )
    np.testing.assert_allclose(world_points(read(text))["/rig/mesh"], [(0, 3, 0), (1, 3, 6), (0, 4, 0)], atol=1e-6)


@pytest.mark.parametrize(("weight", "height"), [(0.25, 1.5), (0.5, 3.0), (0.75, 2.5), (1.0, 2.0), (-1.0, -6.0)])
def test_inbetweens_are_passed_on_the_way(weight: float, height: float) -> None:
    """From 0 to 3 at half the weight, then to 2; below 0 the nearest two shapes are continued."""
    inbetween = "uniform vector3f[] inbetweens:half = [(0, 3, 0), (0, 3, 0), (0, 3, 0)] (\nweight = 0.5\n)"
    text = moulded(f"[{weight}]", shape("up", "[(0, 2, 0), (0, 2, 0), (0, 2, 0)]", inbetween))
    np.testing.assert_allclose(world_points(read(text))["/rig/mesh"][0], (0, 2 + height, 0), atol=1e-6)


def test_normal_offsets_turn_normals() -> None:
    normals = "normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1)]"
    offsets = "uniform vector3f[] normalOffsets = [(1, 0, 0), (0, 0, 0), (1, 0, -1)]"
    text = moulded("[1]", shape("up", "[(0, 2, 0), (0, 2, 0), (0, 2, 0)]", offsets))
    text = text.replace("point3f[] points", f"{normals}\npoint3f[] points")
    expected = [(0.5**0.5, 0, 0.5**0.5), (0, 0, 1), (1, 0, 0)]
    np.testing.assert_allclose(read(text).meshes[0].normals, expected, atol=1e-6)


# What is wrong


@pytest.mark.parametrize(
    ("before", "after", "reason"),
    [
        ("jointIndices = [1, 1, 1]", "jointIndices = [1, 7, 1]", "its joint indices are out of range"),
        ("jointIndices = [1, 1, 1]", "jointIndices = [1, 1]", "its joint influences have no values"),
        ("jointWeights = [1, 1, 1]", "jointWeights = [1, nan, 1]", "its joint weights are not finite"),
        ("uniform matrix4d[] bindTransforms", "uniform matrix4d[] other", "its skeleton has no bind or rest pose"),
        ('"mesh" (prepend apiSchemas = ["SkelBindingAPI"])', '"mesh"', "SkelBindingAPI is not applied to it"),
        ("rel skel:skeleton = <../skeleton>", "", "no skeleton is bound to it"),
    ],
)
def test_a_broken_binding_leaves_the_restshape(before: str, after: str, reason: str) -> None:
    text = rig(animation("anim", (0, 90)) + triangle(interpolation="vertex"), "anim")
    assert before in text
    scene = read(text.replace(before, after))
    np.testing.assert_allclose(world_points(scene)["/rig/mesh"][0], (0, 2, 0))
    assert reasons(scene, "/rig/mesh") == [f"drawn in its rest shape: {reason}"]


@pytest.mark.parametrize(("interpolation", "before"), [("vertex", "half3[] scales"), ("constant", "quatf[] rotations")])
def test_an_animation_that_lacks_some_leaves_the_rest_pose(interpolation: str, before: str) -> None:
    text = rig(animation("anim", (0, 90)) + triangle(interpolation=interpolation), "anim")
    scene = read(text.replace(before, before.replace("] ", "] other")))
    np.testing.assert_allclose(world_points(scene)["/rig/mesh"][0], (0, 2, 0))
    reason = "its animation lacks translations, rotations or scales of all its joints"
    assert reasons(scene, "/rig/mesh") == [f"in the rest pose of its skeleton: {reason}"]


def test_a_blend_shape_that_does_not_fit_is_left_out() -> None:
    scene = read(moulded("[1]", shape("up", "[(0, 2, 0)]")))
    np.testing.assert_allclose(world_points(scene)["/rig/mesh"][0], (0, 2, 0))
    assert reasons(scene, "/rig/mesh") == ["blend shape up is left out: 1 offsets where 3 are due"]
