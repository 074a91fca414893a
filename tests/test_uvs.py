"""Texture coordinates of every type, interpolation and indexing."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

from defshade_cli.usd.surfaces.varying import is_time_varying
from prims import define_cube, define_mesh, read, reasons, set_primvar

POINTS = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [0, 1, 0]]
FACES = [[0, 1, 4, 5], [1, 2, 3, 4]]
CORNERS = [point for face in FACES for point in face]
XY = np.array(POINTS, np.float32)[:, :2]
COUNTS = {"constant": 1, "uniform": 2, "vertex": 6, "varying": 6, "faceVarying": 8}


def pair() -> UsdGeom.Mesh:
    """Two quads side by side, with normals on their points."""
    mesh = define_mesh(POINTS, FACES)
    mesh.CreateNormalsAttr([(0, 0, 1)] * 6)
    return mesh


def floats2(values: np.ndarray) -> Vt.Vec2fArray:
    return Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(values, np.float32))


@pytest.mark.parametrize("interpolation", COUNTS)
def test_each_interpolation_reaches_the_corners_it_is_due_at(interpolation: str) -> None:
    mesh, uv = pair(), np.random.default_rng(7).random((COUNTS[interpolation], 2), np.float32)
    set_primvar(mesh, "st", floats2(uv), interpolation, "texCoord2f[]")
    drawn = read(mesh).mesh
    due = {
        "constant": np.repeat(uv, 8, axis=0),
        "uniform": uv[[0] * 4 + [1] * 4] if len(uv) == 2 else None,
        "faceVarying": uv,
    }.get(interpolation, uv[CORNERS] if len(uv) == 6 else None)
    of_point = {tuple(p): set() for p in POINTS}
    for point, value in zip(np.array(POINTS, float)[CORNERS], due, strict=True):
        of_point[tuple(point)].add(tuple(value))
    for point, value in zip(drawn.points.astype(float), drawn.uvs["st"], strict=True):
        assert tuple(value) in of_point[tuple(point)]


@pytest.mark.parametrize(
    "type_name", ["texCoord2f[]", "texCoord2d[]", "texCoord2h[]", "float2[]", "double2[]", "half2[]"]
)
def test_every_type_of_two_floats_is_read(type_name: str) -> None:
    mesh = pair()
    set_primvar(mesh, "map1", [Gf.Vec2f(*map(float, uv)) for uv in XY], "vertex", type_name)
    np.testing.assert_array_equal(read(mesh).mesh.uvs["map1"], XY)


@pytest.mark.parametrize("type_name", ["texCoord3f[]", "texCoord3d[]", "texCoord3h[]"])
def test_of_three_coordinates_the_first_two_count(type_name: str) -> None:
    mesh = pair()
    set_primvar(mesh, "map1", [Gf.Vec3f(*map(float, uv), 9.0) for uv in XY], "vertex", type_name)
    np.testing.assert_array_equal(read(mesh).mesh.uvs["map1"], XY)


def test_points_stay_shared_where_the_corners_at_each_agree() -> None:
    mesh = pair()
    set_primvar(mesh, "st", floats2(XY[CORNERS]), "faceVarying", "texCoord2f[]")
    drawn = read(mesh).mesh
    np.testing.assert_array_equal(drawn.points, POINTS)
    np.testing.assert_array_equal(drawn.uvs["st"], XY)


def test_a_seam_splits_points() -> None:
    mesh, uv = pair(), XY[CORNERS].copy()
    uv[4:] += 10
    set_primvar(mesh, "st", floats2(uv), "faceVarying", "texCoord2f[]")
    drawn = read(mesh).mesh
    left = drawn.uvs["st"][drawn.triangles[drawn.faces == 0]]
    right = drawn.uvs["st"][drawn.triangles[drawn.faces == 1]]
    assert left.max() <= 1 and right.min() >= 10


def test_indices_are_followed() -> None:
    mesh = pair()
    primvar = set_primvar(mesh, "st", [(0.25, 0.5), (0.75, 0.5)], "faceVarying", "texCoord2f[]")
    primvar.SetIndices(Vt.IntArray([0] * 4 + [1] * 4))
    drawn = read(mesh).mesh
    assert {tuple(uv) for uv in drawn.uvs["st"][drawn.triangles[drawn.faces == 1]].reshape(-1, 2)} == {(0.75, 0.5)}


def test_several_sets_lie_side_by_side_and_other_types_are_none() -> None:
    mesh = pair()
    set_primvar(mesh, "st", floats2(XY), "vertex", "texCoord2f[]")
    set_primvar(mesh, "lightmap", floats2(XY * 0.5), "varying", "float2[]")
    set_primvar(mesh, "rest", POINTS, "vertex", "point3f[]")
    drawn = read(mesh).mesh
    assert set(drawn.uvs) == {"st", "lightmap"}
    np.testing.assert_array_equal(drawn.uvs["lightmap"], XY * 0.5)


def test_a_constant_comes_from_above() -> None:
    stage = Usd.Stage.CreateInMemory()
    group = UsdGeom.Xform.Define(stage, "/group")
    cube = UsdGeom.Cube.Define(stage, "/group/cube")
    UsdGeom.PrimvarsAPI(group).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "constant").Set([(0.5, 0.25)])
    assert (read(cube).mesh.uvs["st"] == (0.5, 0.25)).all()


@pytest.mark.parametrize(
    ("values", "reason"), [(XY[:3], "3 vertex values where 6 are due"), (XY * np.nan, "not all of its values")]
)
def test_what_cannot_be_used_is_left_out_and_said(values: np.ndarray, reason: str) -> None:
    mesh = pair()
    set_primvar(mesh, "st", floats2(values), "vertex", "texCoord2f[]")
    gprim = read(mesh)
    assert not gprim.mesh.uvs and reason in reasons(gprim)[0]


def test_animated_coordinates_make_the_prim_vary() -> None:
    cube = define_cube()
    primvar = set_primvar(cube, "st", [(0, 0)] * 8, "vertex", "texCoord2f[]")
    assert not is_time_varying(cube.GetPrim())
    primvar.Set([(0, 0)] * 8, 1.0)
    primvar.Set([(1, 1)] * 8, 2.0)
    assert is_time_varying(cube.GetPrim())
