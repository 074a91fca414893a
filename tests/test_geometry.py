"""Any surface prim as one mesh: topology, holes, subsets, time, and input that lies."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pxr import Sdf, Usd, UsdGeom, UsdShade, Vt

from defshade_cli.usd.surfaces.geometry import read_surface
from defshade_cli.usd.surfaces.varying import is_time_varying
from prims import (
    CUBE_FACES,
    CUBE_POINTS,
    DEFAULT,
    Drawn,
    area,
    define_cube,
    define_mesh,
    define_raw_mesh,
    is_watertight,
    new_stage,
    read,
    reasons,
    set_primvar,
    try_read,
    volume,
)

TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def assert_sound(gprim: Drawn) -> None:
    """What every mesh keeps, whatever was authored."""
    mesh = gprim.mesh
    assert mesh.triangles.size == 0 or mesh.triangles.max() < len(mesh.points)
    drawn = np.unique(mesh.triangles)
    assert np.isfinite(mesh.points[drawn]).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.normals[drawn].astype(float), axis=1), 1.0, atol=1e-5)
    assert [group.first for group in gprim.groups] == np.cumsum([0, *(g.count for g in gprim.groups)])[:-1].tolist()
    assert sum(group.count for group in gprim.groups) == len(mesh.triangles)
    assert all(group.count for group in gprim.groups)
    assert all(issue.path == mesh.path and issue.reason for issue in gprim.issues)


def test_a_cube_of_quads() -> None:
    gprim = read(define_cube())
    assert volume(gprim.mesh) == pytest.approx(8.0) and area(gprim.mesh) == pytest.approx(24.0)
    assert is_watertight(gprim.mesh)
    assert gprim.mesh.faces.tolist() == np.repeat(np.arange(6), 2).tolist()
    assert [(g.path, g.first, g.count) for g in gprim.groups] == [("/mesh", 0, 12)]
    assert_sound(gprim)


def test_left_handed_faces_are_turned_outwards() -> None:
    mesh = define_mesh(CUBE_POINTS, [face[::-1] for face in CUBE_FACES])
    assert volume(read(mesh).mesh) == pytest.approx(-8.0)
    mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    assert volume(read(mesh).mesh) == pytest.approx(8.0)


def test_double_sided_is_passed_on() -> None:
    mesh = define_cube()
    assert not read(mesh).mesh.double_sided
    mesh.CreateDoubleSidedAttr(True)
    assert read(mesh).mesh.double_sided


def test_points_are_not_copied_while_they_stay_shared() -> None:
    """Two readings of one value are views of the same memory."""
    mesh = define_cube("catmullClark")
    first, second = read(mesh).mesh, read(mesh).mesh
    assert np.shares_memory(first.points, second.points)


@pytest.mark.parametrize("scheme", ["none", "catmullClark"])
def test_holes_are_not_drawn_but_shape_the_normals(scheme: str) -> None:
    mesh = define_cube(scheme)
    whole = read(mesh).mesh
    mesh.CreateHoleIndicesAttr([1, 4])
    gprim = read(mesh)
    assert np.unique(gprim.mesh.faces).tolist() == [0, 2, 3, 5] and not gprim.issues
    assert area(gprim.mesh) == pytest.approx(16.0)
    if scheme == "catmullClark":
        np.testing.assert_array_equal(gprim.mesh.normals, whole.normals)


def test_holes_that_are_no_faces_are_said() -> None:
    mesh = define_cube()
    mesh.CreateHoleIndicesAttr([-1, 0, 6])
    gprim = read(mesh)
    assert len(gprim.mesh.triangles) == 10 and reasons(gprim) == ["2 holeIndices name no face"]


def test_other_types_are_not_ours() -> None:
    stage = new_stage()
    for name in ("HermiteCurves", "Xform", "Camera", ""):
        prim = stage.DefinePrim(f"/other_{name}", name)
        assert read_surface(prim, DEFAULT) is None and not is_time_varying(prim)


# Subsets


def add_subset(
    mesh: UsdGeom.Mesh, name: str, faces: list[int], family: str = "materialBind", element: str = "face"
) -> None:
    subset = UsdGeom.Subset.Define(mesh.GetPrim().GetStage(), f"/mesh/{name}")
    subset.CreateElementTypeAttr(element)
    subset.CreateFamilyNameAttr(family)
    subset.CreateIndicesAttr(Vt.IntArray(faces))


def groups_of(gprim: Drawn) -> dict[str, list[int]]:
    """The faces that each group draws."""
    return {
        group.path: np.unique(gprim.mesh.faces[group.first : group.first + group.count]).tolist()
        for group in gprim.groups
    }


def test_subsets_are_runs_after_the_faces_that_none_holds() -> None:
    mesh = define_cube()
    add_subset(mesh, "b", [5, 0])
    add_subset(mesh, "a", [2])
    gprim = read(mesh)
    assert groups_of(gprim) == {"/mesh": [1, 3, 4], "/mesh/b": [0, 5], "/mesh/a": [2]}
    assert volume(gprim.mesh) == pytest.approx(8.0)
    assert_sound(gprim)


def test_subsets_that_hold_all_faces_leave_no_group_of_the_mesh() -> None:
    mesh = define_cube()
    add_subset(mesh, "a", [0, 1, 2])
    add_subset(mesh, "b", [3, 4, 5])
    add_subset(mesh, "empty", [])
    assert groups_of(read(mesh)) == {"/mesh/a": [0, 1, 2], "/mesh/b": [3, 4, 5]}


def test_only_faces_of_the_material_family_count() -> None:
    mesh = define_cube()
    add_subset(mesh, "points", [0], element="point")
    add_subset(mesh, "other", [1], family="selection")
    assert groups_of(read(mesh)) == {"/mesh": [0, 1, 2, 3, 4, 5]}


def test_subset_faces_are_counted_as_authored_also_past_broken_ones() -> None:
    mesh = define_mesh(CUBE_POINTS, [CUBE_FACES[0], [0, 1], *CUBE_FACES[1:]])
    add_subset(mesh, "a", [1, 2, 3])
    assert groups_of(read(mesh)) == {"/mesh": [0, 4, 5, 6], "/mesh/a": [2, 3]}


def test_overlaps_and_indices_out_of_range_are_said() -> None:
    mesh = define_cube()
    add_subset(mesh, "a", [0, 1, 6, -1])
    add_subset(mesh, "b", [1, 2])
    gprim = read(mesh)
    assert groups_of(gprim) == {"/mesh": [3, 4, 5], "/mesh/a": [0, 1], "/mesh/b": [2]}
    assert reasons(gprim) == [
        "subset a: 2 indices name no face",
        "subset b: 1 faces belong to an earlier subset",
    ]


def test_groups_are_what_materials_bind_to() -> None:
    mesh = define_cube()
    add_subset(mesh, "a", [0])
    stage = mesh.GetPrim().GetStage()
    red = UsdShade.Material.Define(stage, "/red")
    UsdShade.MaterialBindingAPI.Apply(stage.GetPrimAtPath("/mesh/a")).Bind(red)
    bound = [
        UsdShade.MaterialBindingAPI(stage.GetPrimAtPath(g.path)).ComputeBoundMaterial()[0].GetPath()
        for g in read(mesh).groups
    ]
    assert bound == [Sdf.Path(), Sdf.Path("/red")]


# Time


def test_points_are_read_at_the_time() -> None:
    mesh = define_cube("catmullClark")
    for time in (1.0, 3.0):
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(CUBE_POINTS * np.float32(time)), time)
    np.testing.assert_array_equal(read(mesh, Usd.TimeCode(2.0)).mesh.points, 2.0 * CUBE_POINTS)
    assert is_time_varying(mesh.GetPrim())


def test_one_sample_is_no_motion() -> None:
    mesh = define_cube()
    mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(CUBE_POINTS), 1.0)
    assert not is_time_varying(mesh.GetPrim())


def test_what_may_vary() -> None:
    """Colours inherited and indices of subsets too; what is not read does not count."""
    stage = new_stage()
    parent = UsdGeom.Xform.Define(stage, "/parent")
    sphere = UsdGeom.Sphere.Define(stage, "/parent/sphere")
    ball = UsdGeom.Sphere.Define(stage, "/ball")
    mesh = define_cube()
    add_subset(mesh, "a", [0])
    spun = define_cube()
    assert not any(is_time_varying(p.GetPrim()) for p in (sphere, ball, mesh, spun))
    color = set_primvar(parent, "displayColor", [(1, 0, 0)], "constant")
    indices = UsdGeom.Subset.Get(mesh.GetPrim().GetStage(), "/mesh/a").GetIndicesAttr()
    for time in (1.0, 2.0):
        color.Set([(time, 0, 0)], time)
        ball.GetRadiusAttr().Set(time, time)
        indices.Set(Vt.IntArray([int(time)]), time)
        spun.GetVelocitiesAttr().Set([(time, 0, 0)], time)
        spun.GetExtentAttr().Set([(-1, -1, -1), (time, 1, 1)], time)
    assert is_time_varying(sphere.GetPrim()) and is_time_varying(ball.GetPrim()) and is_time_varying(mesh.GetPrim())
    assert not is_time_varying(spun.GetPrim())


def test_no_frame_rate_does_not_hang() -> None:
    mesh = define_cube()
    mesh.GetPrim().GetStage().SetTimeCodesPerSecond(0.0)
    mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(CUBE_POINTS), 1.0)
    assert not is_time_varying(mesh.GetPrim())


# Input that lies


@pytest.mark.parametrize(
    ("points", "counts", "indices", "drawn", "reason"),
    [
        ([], [3], [0, 1, 2], 0, "it has no points"),
        (TRIANGLE, [], [], 0, "it has no faces"),
        (TRIANGLE, [3], [], 0, "it has no faces"),
        (TRIANGLE, [3, 3], [0, 1, 2, 0, 1], 1, "1 faces are left out: faceVertexIndices ends before them"),
        (TRIANGLE, [3, 2**31 - 1, 3], [0, 1, 2], 1, "2 faces are left out: faceVertexIndices ends before them"),
        (TRIANGLE, [3], [0, 1, 2, 0, 1], 1, "2 faceVertexIndices are left over after the last face"),
        (TRIANGLE, [3, -3, 3], [0, 1, 2, 2, 1, 0], 2, "1 faces are left out: they have fewer than 3 corners"),
        (TRIANGLE, [2, 0, 3], [0, 1, 0, 1, 2], 1, "2 faces are left out: they have fewer than 3 corners"),
        (TRIANGLE, [3, 3], [0, 1, 2, 0, 1, 3], 1, "1 faces are left out: their indices are out of range"),
        (TRIANGLE, [3, 3], [0, 1, -1, 0, 1, 2], 1, "1 faces are left out: their indices are out of range"),
        (
            [*TRIANGLE, [np.nan, 0, 0]],
            [3, 3],
            [0, 1, 2, 0, 1, 3],
            1,
            "1 faces are left out: their points are not finite",
        ),
        (
            [*TRIANGLE, [0, np.inf, 0]],
            [3, 3],
            [0, 1, 2, 3, 1, 3],
            1,
            "1 faces are left out: their points are not finite",
        ),
    ],
)
def test_the_bad_part_is_left_out_and_said(points: list, counts: list, indices: list, drawn: int, reason: str) -> None:
    gprim = read(define_raw_mesh(points, counts, indices))
    assert len(gprim.mesh.triangles) == drawn
    assert reasons(gprim) == [reason]
    assert_sound(gprim)


def test_unused_points_may_be_anything() -> None:
    gprim = read(define_mesh([*TRIANGLE, [np.nan] * 3], [[0, 1, 2]], "catmullClark"))
    assert not gprim.issues and np.isfinite(gprim.mesh.bounds).all()


def test_a_mesh_of_nothing() -> None:
    gprim = read(UsdGeom.Mesh.Define(new_stage(), "/mesh"))
    assert gprim.mesh.triangles.shape == (0, 3) and gprim.groups == ()
    assert reasons(gprim) == ["it has no points"]


def test_an_unknown_scheme_is_said() -> None:
    gprim = read(define_cube("smooth"))
    assert len(gprim.mesh.triangles) == 12
    assert "'smooth'" in reasons(gprim)[0]


def test_claims_take_no_memory() -> None:
    mesh = define_raw_mesh(TRIANGLE, [2**31 - 1] * 64, [0, 1, 2])
    tracemalloc.start()
    read(mesh)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1 << 20


numbers = st.integers(-2, 9) | st.sampled_from([-(2**31), 2**31 - 1])
floats = st.sampled_from([0.0, 1.0, -1.0, 2.0, 3.4e38, 1e-38, np.nan, np.inf, -np.inf])
vectors = st.lists(st.tuples(floats, floats, floats), max_size=9)


@given(
    points=vectors,
    counts=st.lists(numbers, max_size=6),
    indices=st.lists(numbers, max_size=24),
    holes=st.lists(numbers, max_size=3),
    normals=vectors,
    colors=vectors,
    lookup=st.none() | st.lists(numbers, max_size=8),
    subset=st.lists(numbers, max_size=4),
    interpolation=st.sampled_from(["constant", "uniform", "varying", "vertex", "faceVarying", "none"]),
    scheme=st.sampled_from(["none", "catmullClark", "bilinear"]),
)
@settings(max_examples=300, deadline=None)
def test_no_mesh_is_bad_enough_to_raise(
    points, counts, indices, holes, normals, colors, lookup, subset, interpolation, scheme
) -> None:
    mesh = define_raw_mesh(points, counts, indices, scheme)
    mesh.CreateHoleIndicesAttr(Vt.IntArray(holes))
    mesh.CreateNormalsAttr(Vt.Vec3fArray(normals))
    mesh.GetNormalsAttr().SetMetadata("interpolation", interpolation)
    primvar = set_primvar(mesh, "displayColor", Vt.Vec3fArray(colors), "constant")
    primvar.GetAttr().SetMetadata("interpolation", interpolation)
    if lookup is not None:
        primvar.SetIndices(Vt.IntArray(lookup))
    add_subset(mesh, "a", subset)
    with np.errstate(all="raise", under="ignore"):
        cage, refined = read(mesh), read(mesh, level=2)
    assert_sound(cage)
    assert_sound(refined)


# Stages by others


def test_every_surface_of_the_stages_by_others(assets: Path) -> None:
    """No exception, and sound meshes, at the default and the first time. Prototypes are read once."""
    files = sorted(f for f in assets.rglob("*") if f.suffix in (".usd", ".usda", ".usdc", ".usdz"))
    surfaces = 0
    for file in files:
        stage = Usd.Stage.Open(str(file), Usd.Stage.LoadAll)
        prims = [*stage.Traverse(), *(p for prototype in stage.GetPrototypes() for p in Usd.PrimRange(prototype))]
        for prim in prims:
            for time in (DEFAULT, Usd.TimeCode(stage.GetStartTimeCode())):
                gprim = try_read(prim, time, level=1)
                if gprim is not None:
                    surfaces += 1
                    assert_sound(gprim)
            is_time_varying(prim)
    assert surfaces > 500
