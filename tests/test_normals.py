"""Normals computed from the shape, and authored ones made fit to shade with."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import UsdGeom, Vt

from prims import CUBE_FACES, CUBE_POINTS, define_cube, define_mesh, read, reasons, set_primvar, vector_areas

FLOOR = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)


def at_corners(gprim) -> np.ndarray:
    """(T, 3, 3) the normals at each triangle's corners."""
    return gprim.mesh.normals[gprim.mesh.triangles]


def author(mesh: UsdGeom.Mesh, normals: object, interpolation: str) -> None:
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(normals, np.float32).reshape(-1, 3)))
    mesh.SetNormalsInterpolation(interpolation)


@pytest.mark.parametrize("scheme", ["none", "bilinear"])
def test_without_normals_polygons_are_faceted(scheme: str) -> None:
    gprim = read(define_cube(scheme))
    facets = vector_areas(gprim.mesh) / 2.0  # each triangle is half of a 2×2 face
    np.testing.assert_allclose(at_corners(gprim), np.repeat(facets[:, None], 3, axis=1), atol=1e-6)
    assert not gprim.issues


@pytest.mark.parametrize("scheme", ["catmullClark", "loop"])
def test_smooth_normals_of_a_cube_are_its_diagonals_whichever_way_it_is_cut(scheme: str) -> None:
    triangles = [triangle for a, b, c, d in CUBE_FACES for triangle in ([a, b, c], [a, c, d])]
    for faces in (CUBE_FACES, triangles):
        mesh = read(define_mesh(CUBE_POINTS, faces, scheme)).mesh
        np.testing.assert_allclose(mesh.normals, CUBE_POINTS / np.sqrt(3.0), atol=1e-6)


@pytest.mark.parametrize("scheme", ["none", "catmullClark"])
def test_left_handed_normals_follow_the_turned_winding(scheme: str) -> None:
    mesh = define_cube(scheme)
    mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    gprim = read(mesh)
    assert (np.einsum("ti,tki->tk", vector_areas(gprim.mesh), at_corners(gprim)) > 0.0).all()
    assert (np.einsum("ti,ti->t", vector_areas(gprim.mesh), gprim.mesh.points[gprim.mesh.triangles[:, 0]]) < 0).all()


@pytest.mark.parametrize("scale", [1e-15, 1.0, 1e15])
@pytest.mark.parametrize("scheme", ["none", "catmullClark"])
def test_scale_is_of_no_account(scale: float, scheme: str) -> None:
    normals = read(define_mesh(FLOOR * scale, [[0, 1, 2, 3]], scheme)).mesh.normals
    np.testing.assert_array_equal(normals, np.broadcast_to([0.0, 0.0, 1.0], (4, 3)))


def test_a_fold_onto_itself_still_has_unit_normals() -> None:
    mesh = read(define_mesh(FLOOR, [[0, 1, 2, 3], [3, 2, 1, 0]], "catmullClark")).mesh
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)


def test_a_face_without_area_still_has_unit_normals() -> None:
    mesh = read(define_mesh(np.zeros((3, 3)), [[0, 1, 2]])).mesh
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)


AUTHORED = {
    "constant": [[0, 0, 2]],
    "uniform": [[0, 0, 2], [0, 1, 1]],
    "vertex": [[0, 0, 2], [0, 1, 1], [1, 0, 1], [0, 0, 1], [0, -1, 1], [-1, 0, 1]],
    "varying": [[0, 0, 2], [0, 1, 1], [1, 0, 1], [0, 0, 1], [0, -1, 1], [-1, 0, 1]],
    "faceVarying": [[0, 0, 2], [0, 1, 1], [1, 0, 1], [0, 0, 1], [0, -1, 1], [-1, 0, 1], [0, 1, 2], [1, 0, 2]],
}
PAIR_POINTS = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [0, 1, 0]]
PAIR_FACES = [[0, 1, 4, 5], [1, 2, 3, 4]]


@pytest.mark.parametrize("interpolation", AUTHORED)
def test_authored_normals_of_every_interpolation(interpolation: str) -> None:
    mesh = define_mesh(PAIR_POINTS, PAIR_FACES)
    author(mesh, AUTHORED[interpolation], interpolation)
    gprim = read(mesh)
    unit = np.array(AUTHORED[interpolation]) / np.linalg.norm(AUTHORED[interpolation], axis=1, keepdims=True)
    by_corner = {
        "constant": lambda face, corner, point: 0,
        "uniform": lambda face, corner, point: face,
        "vertex": lambda face, corner, point: point,
        "varying": lambda face, corner, point: point,
        "faceVarying": lambda face, corner, point: corner,
    }[interpolation]
    expected = [
        unit[by_corner(face, 4 * face + local, PAIR_FACES[face][local])]
        for face in (0, 1)
        for cut in ((0, 1, 2), (0, 2, 3))
        for local in cut
    ]
    np.testing.assert_allclose(at_corners(gprim).reshape(-1, 3), expected, atol=1e-6)
    assert not gprim.issues
    assert len(gprim.mesh.points) == (8 if interpolation in ("uniform", "faceVarying") else 6)


def test_the_primvar_wins_over_the_attribute() -> None:
    mesh = define_mesh(FLOOR, [[0, 1, 2, 3]])
    author(mesh, [[0, 1, 1]], "constant")
    set_primvar(mesh, "normals", [(1, 0, 1)], "constant", "normal3f[]")
    np.testing.assert_allclose(read(mesh).mesh.normals[0], [np.sqrt(0.5), 0.0, np.sqrt(0.5)], atol=1e-6)


def test_indexed_normals() -> None:
    mesh = define_mesh(FLOOR, [[0, 1, 2, 3]])
    primvar = set_primvar(mesh, "normals", [(0, 0, 1), (1, 0, 0)], "faceVarying", "normal3f[]")
    primvar.SetIndices(Vt.IntArray([0, 1, 0, 1]))
    np.testing.assert_array_equal(read(mesh).mesh.normals, [[0, 0, 1], [1, 0, 0], [0, 0, 1], [1, 0, 0]])


def test_a_primvar_that_does_not_fit_leaves_the_attribute() -> None:
    mesh = define_mesh(FLOOR, [[0, 1, 2, 3]])
    author(mesh, [[0, 1, 1]], "constant")
    set_primvar(mesh, "normals", [(1, 0, 1)] * 3, "vertex", "normal3f[]")
    gprim = read(mesh)
    np.testing.assert_allclose(gprim.mesh.normals[0], [0.0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-6)
    assert "primvars:normals has 3 vertex values where 4 are due" in reasons(gprim)[0]


@pytest.mark.parametrize("scheme", ["catmullClark", "loop", "bilinear"])
def test_subdivision_surfaces_ignore_authored_normals(scheme: str) -> None:
    mesh = define_mesh(FLOOR[:3], [[0, 1, 2]], scheme)
    author(mesh, [[1, 0, 0]], "constant")
    np.testing.assert_allclose(read(mesh).mesh.normals, [[0, 0, 1]] * 3, atol=1e-6)


@pytest.mark.parametrize("interpolation", ["constant", "uniform", "vertex", "faceVarying"])
@pytest.mark.parametrize("lost", [(0, 0, 0), (np.nan, 0, 1), (np.inf, 0, 0)])
def test_normals_without_a_direction_follow_from_the_shape(interpolation: str, lost: tuple) -> None:
    mesh = define_mesh(FLOOR, [[0, 1, 2, 3]])
    count = {"constant": 1, "uniform": 1, "vertex": 4, "faceVarying": 4}[interpolation]
    author(mesh, [lost] + [(0, 1, 1)] * (count - 1), interpolation)
    gprim = read(mesh)
    np.testing.assert_allclose(gprim.mesh.normals[0], [0, 0, 1], atol=1e-6)
    assert reasons(gprim) == ["1 normals have no direction and follow from the shape"]


def test_normals_that_oppose_the_winding_turn_it() -> None:
    mesh = define_mesh(FLOOR, [[0, 1, 2, 3]])
    author(mesh, [[0, 0, -1]], "constant")
    gprim = read(mesh)
    assert (vector_areas(gprim.mesh)[:, 2] < 0.0).all()
    np.testing.assert_array_equal(gprim.mesh.normals[0], [0, 0, -1])
    assert reasons(gprim) == ["the normals oppose the winding, which is reversed"]


@pytest.mark.parametrize("share", [0.0, 0.4, 0.6, 1.0])
def test_the_most_of_a_large_mesh_decide_which_way_it_is_wound(share: float) -> None:
    """Some of its faces are asked first; where they are of two minds, all are."""
    side = 40
    points = np.array([(x, y, 0) for y in range(side + 1) for x in range(side + 1)], np.float32)
    corners = [y * (side + 1) + x for y in range(side) for x in range(side)]
    mesh = define_mesh(points, [[c, c + 1, c + side + 2, c + side + 1] for c in corners])
    author(mesh, [[0, 0, -1 if number < share * side**2 else 1] for number in range(side**2)], "uniform")
    gprim = read(mesh)
    assert (vector_areas(gprim.mesh)[:, 2] < 0.0).all() == (share > 0.5)
    assert bool(gprim.issues) == (share > 0.5)


def test_normals_that_only_slant_leave_the_winding() -> None:
    """A constant normal on a cube agrees with as many faces as it opposes."""
    mesh = define_cube()
    author(mesh, [[1, 0, 0]], "constant")
    gprim = read(mesh)
    assert not gprim.issues
    assert (np.einsum("ti,ti->t", vector_areas(gprim.mesh), gprim.mesh.points[gprim.mesh.triangles[:, 0]]) > 0).all()
