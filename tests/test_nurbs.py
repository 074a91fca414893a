"""NurbsPatch: on the surface, facing outwards, with its colours; and what is wrong with one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import UsdGeom, Vt

from defshade_cli.usd.geometry import is_time_varying
from prims import new_stage, read, reasons, set_primvar

HALF = math.sqrt(0.5)
CIRCLE = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], float)
WEIGHTS = np.array([1, HALF] * 4 + [1])
CIRCLE_KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]


def patch(points: NDArray, u: tuple[int, int, list], v: tuple[int, int, list], weights: NDArray | None = None):
    schema = UsdGeom.NurbsPatch.Define(new_stage(), "/patch")
    schema.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points.reshape(-1, 3), np.float32)))
    for name, (count, order, knots) in {"U": u, "V": v}.items():
        getattr(schema, f"Create{name}VertexCountAttr")(count)
        getattr(schema, f"Create{name}OrderAttr")(order)
        getattr(schema, f"Create{name}KnotsAttr")(knots)
    if weights is not None:
        schema.CreatePointWeightsAttr(weights.ravel().tolist())
    return schema


def tube() -> UsdGeom.NurbsPatch:
    """A cylinder of radius 1 and height 2: a circle along u, exact as a rational one, a line along v."""
    points = np.stack([np.column_stack([CIRCLE, np.full(9, z)]) for z in (0.0, 2.0)])
    return patch(points, (9, 3, CIRCLE_KNOTS), (2, 2, [0, 0, 1, 1]), np.tile(WEIGHTS, 2))


def test_a_rational_patch_lies_on_its_cylinder() -> None:
    drawn = read(tube())
    radial = drawn.mesh.points * (1, 1, 0)
    np.testing.assert_allclose(np.linalg.norm(radial, axis=1), 1, rtol=1e-6)
    np.testing.assert_allclose(drawn.mesh.normals, radial, atol=1e-5)
    np.testing.assert_allclose(drawn.mesh.bounds, [[-1, -1, 0], [1, 1, 2]], atol=1e-6)
    a, b, c = drawn.mesh.points[drawn.mesh.triangles].swapaxes(0, 1)
    assert (np.einsum("ti,ti->t", np.cross(b - a, c - a), a * (1, 1, 0)) > 0).all() and not drawn.issues


def test_left_handed_patches_face_the_other_way() -> None:
    schema = tube()
    schema.CreateOrientationAttr("leftHanded")
    drawn = read(schema)
    a, b, c = drawn.mesh.points[drawn.mesh.triangles].swapaxes(0, 1)
    assert (np.einsum("ti,ti->t", np.cross(b - a, c - a), drawn.mesh.normals[drawn.mesh.triangles[:, 0]]) > 0).all()
    np.testing.assert_allclose(drawn.mesh.normals, -drawn.mesh.points * (1, 1, 0), atol=1e-5)


def test_a_range_cuts_the_patch() -> None:
    schema = tube()
    schema.CreateURangeAttr((0.0, 1.0))
    np.testing.assert_allclose(read(schema).mesh.bounds, [[0, 0, 0], [1, 1, 2]], atol=1e-6)


def test_vertex_primvars_follow_the_control_points() -> None:
    grid = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0)), axis=-1)
    points = np.concatenate([grid, np.zeros((4, 4, 1))], axis=-1)
    schema = patch(points, (4, 4, [0] * 4 + [1] * 4), (4, 4, [0] * 4 + [1] * 4))
    set_primvar(schema, "st", [tuple(map(float, p)) for p in grid.reshape(-1, 2)], "vertex", "texCoord2f[]")
    mesh = read(schema).mesh
    np.testing.assert_allclose(mesh.uvs["st"], mesh.points[:, :2], atol=1e-6)
    assert len(mesh.points) == 81 and (mesh.normals == (0, 0, 1)).all()


def test_a_pole_has_a_normal() -> None:
    points = np.stack([np.column_stack([CIRCLE * r, np.full(9, z)]) for r, z in ((1.0, 0.0), (0.0, 1.0))])
    drawn = read(patch(points, (9, 3, CIRCLE_KNOTS), (2, 2, [0, 0, 1, 1]), np.tile(WEIGHTS, 2)))
    np.testing.assert_allclose(np.linalg.norm(drawn.mesh.normals, axis=1), 1, rtol=1e-5)
    assert (drawn.mesh.normals[:, 2] > 0.1).all()


@pytest.mark.parametrize(
    ("attribute", "value", "reason"),
    [
        ("uOrder", 1, "uOrder 1 and 9 points along u make no surface"),
        ("vKnots", [0, 1], "vKnots are not 4 ascending numbers"),
        ("vKnots", [0, 0, -1, 1], "vKnots are not 4 ascending numbers"),
        ("uRange", (3.0, 3.0), "uRange is empty"),
        ("pointWeights", [1.0], "pointWeights are not 18 positive numbers"),
        ("uVertexCount", 8, "uKnots are not 11 ascending numbers"),
    ],
)
def test_bad_patches_are_left_out_and_said(attribute: str, value: object, reason: str) -> None:
    schema = tube()
    schema.GetPrim().GetAttribute(attribute).Set(value)
    drawn = read(schema)
    assert reasons(drawn) == [f"it is left out: {reason}"] and not drawn.surface.groups


def test_trim_curves_are_said_to_be_ignored() -> None:
    schema = tube()
    schema.CreateTrimCurveCountsAttr([1])
    assert reasons(read(schema)) == ["trim curves are ignored: the whole patch is drawn"]


def test_moving_points_make_the_patch_vary() -> None:
    schema = tube()
    assert not is_time_varying(schema.GetPrim())
    points = schema.GetPointsAttr().Get()
    schema.GetPointsAttr().Set(points, 1.0)
    schema.GetPointsAttr().Set(Vt.Vec3fArray([p * 2 for p in points]), 2.0)
    assert is_time_varying(schema.GetPrim())
