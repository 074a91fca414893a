"""What skeletons bend besides the points of meshes: normals that no blend shape speaks of, curves, points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from defshade_cli.usd.gprims.gprims import cube, sphere
from defshade_cli.usd.polygons.normals import faceted
from defshade_cli.usd.polygons.polygons import Polygons, Primvar
from defshade_cli.usd.skel.transport import transported
from rigs import animation, moulded, rig, shape, world_points
from stages import read, reasons

SHEAR = np.array([[1.0, 0.5, 0.0], [0.0, 2.0, -0.7], [0.0, 0.0, 0.5]])


def through_shear(normals: np.ndarray) -> np.ndarray:
    turned = normals @ np.linalg.inv(SHEAR)
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)


def test_hard_edges_stay_hard_under_a_shape_that_says_nothing_of_normals() -> None:
    """A cube, each corner of which has the normal of its face: by the inverse transpose of what the shape does."""
    box = cube(2.0)
    authored = box.at_corners(faceted(box))
    found = transported(
        replace(box, normals=Primvar(authored, "faceVarying")), (box.points @ SHEAR.T).astype(np.float32)
    )
    assert found is not None and found.interpolation == "faceVarying"
    np.testing.assert_allclose(found.values, through_shear(authored), atol=1e-6)


def test_normals_stay_outside_at_corners_that_turn_inwards_and_on_left_handed_faces() -> None:
    """Of an L, whose corners run either way around."""
    points = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)], np.float32)
    up = Primvar(np.tile(np.float32([0.0, 0.0, 1.0]), (6, 1)), "faceVarying")
    for order, left_handed in ((np.arange(6), False), (np.arange(6)[::-1], True)):
        face = Polygons(points, np.array([6]), order, np.zeros(1, np.int32), left_handed=left_handed, normals=up)
        found = transported(face, (points @ SHEAR.T).astype(np.float32))
        assert found is not None
        np.testing.assert_allclose(found.values, through_shear(up.values), atol=1e-6)


def test_smooth_normals_stay_smooth_and_follow_the_surface() -> None:
    """A ball that a shape makes an ellipsoid, to the angle between its facets."""
    ball = sphere(1.0)
    found = transported(ball, (ball.points @ SHEAR.T).astype(np.float32))
    assert ball.normals is not None and found is not None and found.interpolation == "vertex"
    cosines = np.einsum("ni,ni->n", found.values, through_shear(ball.normals.values))
    assert np.degrees(np.arccos(cosines.min())) < 360 / 64 / 2


def test_a_smooth_bulge_keeps_smooth_normals_and_a_stage_says_so() -> None:
    """A shape without normalOffsets tilts the triangle by 45° about x; the authored normals go with it."""
    normals = "normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1)]"
    text = moulded("[1]", shape("up", "[(0, 0, 1)]", "uniform int[] pointIndices = [2]"))
    text = text.replace("point3f[] points", f"{normals}\npoint3f[] points")
    np.testing.assert_allclose(read(text).meshes[0].normals, [(0, -(0.5**0.5), 0.5**0.5)] * 3, atol=1e-6)


# Other things that joints bend


def bound(body: str, type_name: str, count: int) -> str:
    joints = f"int[] primvars:skel:jointIndices = {[0, 1][:count] + [1] * (count - 2)}"
    weights = f"float[] primvars:skel:jointWeights = {[1] * count}"
    kind = '(\nelementSize = 1\ninterpolation = "vertex"\n)'
    return f"""def {type_name} "hair" (prepend apiSchemas = ["SkelBindingAPI"]) {{
        rel skel:skeleton = <../skeleton>
        {joints} {kind}
        {weights} {kind}
        {body}
    }}"""


def test_joints_bend_curves() -> None:
    """A line of which the lower point stays and the upper one goes with its joint; its ribbon turns too."""
    body = """point3f[] points = [(0, 0, 0), (0, 3, 0)]
        int[] curveVertexCounts = [2]
        uniform token type = "linear"
        float[] widths = [0.2] (interpolation = "constant")
        normal3f[] normals = [(0, 0, 1), (1, 0, 0)] (interpolation = "vertex")"""
    scene = read(rig(animation("anim", (0, 90)) + bound(body, "BasisCurves", 2), "anim"))
    points = world_points(scene)["/rig/hair"].reshape(2, 2, 3).mean(axis=1)
    np.testing.assert_allclose(points, [(0, 0, 0), (-2, 1, 0)], atol=1e-6)
    assert not reasons(scene, "/rig/hair")
    assert np.abs(scene.meshes[0].normals[2:, 1]).min() > 0.8, (
        "what was along x is along y, but for the curve's own way"
    )


def test_joints_carry_points() -> None:
    body = """point3f[] points = [(0, 0, 0), (0, 2, 0), (nan, 0, 0), (0, 3, 0)]
        float[] widths = [0.5]"""
    scene = read(rig(animation("anim", (0, 90)) + bound(body, "Points", 4), "anim"))
    placed = scene.drawables[0].world_from_object
    np.testing.assert_allclose(placed[:, :3, 3], [(0, 0, 0), (-1, 1, 0), (-2, 1, 0)], atol=1e-6)
    np.testing.assert_allclose(placed[:, 0, 0], 0.5)
    assert scene.drawables[0].instance_ids.tolist() == [0, 1, 3]


def test_a_patch_is_not_bent_and_said() -> None:
    body = (
        "point3f[] points = [(0, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0)]\nint uVertexCount = 2\nint vVertexCount = 2\n"
    )
    body += "int uOrder = 2\nint vOrder = 2\ndouble[] uKnots = [0, 0, 1, 1]\ndouble[] vKnots = [0, 0, 1, 1]"
    scene = read(rig(animation("anim", (0, 90)) + bound(body, "NurbsPatch", 4), "anim"))
    reason = "drawn in its rest shape: only meshes, curves and points are bent by a skeleton"
    assert reason in reasons(scene, "/rig/hair")
