"""Subdivision surfaces as they are drawn: on the limit, with all that lies on them, kept while nothing changes."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdShade, Vt

from defshade_cli.usd.polygons import refiner
from defshade_cli.usd.surfaces.geometry import read_surface
from defshade_cli.usd.surfaces.tessellation import Tessellation
from defshade_cli.usd.surfaces.varying import is_time_varying
from prims import CUBE_FACES, CUBE_POINTS, Drawn, define_cube, define_mesh, is_watertight, read, reasons, set_primvar
from prims import volume as volume_of

GRID = [[x, y, 0] for y in range(3) for x in range(3)]
GRID_FACES = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]]


def ball() -> UsdGeom.Mesh:
    return define_cube("catmullClark")


def sharpest_turn(drawn: Drawn) -> float:
    """Greatest angle in degrees between a triangle and its corners' normals."""
    a, b, c = drawn.mesh.points[drawn.mesh.triangles].astype(float).swapaxes(0, 1)
    across = np.cross(b - a, c - a)
    facets = across / np.linalg.norm(across, axis=1, keepdims=True)
    cosines = np.einsum("ti,tci->tc", facets, drawn.mesh.normals[drawn.mesh.triangles].astype(float))
    return float(np.degrees(np.arccos(cosines.min())))


@pytest.mark.parametrize("level", [1, 2, 4])
def test_a_cube_becomes_a_closed_ball_with_normals_that_agree(level: int) -> None:
    drawn = read(ball(), level=level)
    assert is_watertight(drawn.mesh) and drawn.mesh.level == level and not drawn.issues
    assert len(drawn.mesh.triangles) == 6 * 2 * 4**level
    assert sharpest_turn(drawn) < 75 / 2**level
    assert len(drawn.mesh.points) == 6 * 4**level + 2


def test_every_level_lies_on_the_same_surface() -> None:
    """Points of level 2 are among those of level 4, so the picture grows finer and does not move."""
    coarse, fine = (read(ball(), level=level).mesh.points for level in (2, 4))
    apart = np.linalg.norm(coarse[:, None] - fine[None], axis=-1).min(axis=1)
    assert apart.max() < 1e-6


def test_volume_converges_by_the_square_of_the_edge() -> None:
    volumes = [volume_of(read(ball(), level=level).mesh) for level in (2, 3, 4, 5)]
    steps = np.diff(volumes)
    np.testing.assert_allclose(steps[:-1] / steps[1:], 4, rtol=0.15)


def test_meshes_that_are_wired_alike_share_their_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    creased = ball()
    creased.CreateCreaseIndicesAttr([0, 1])
    creased.CreateCreaseLengthsAttr([2])
    creased.CreateCreaseSharpnessesAttr([3.0])
    cages = [read_surface(mesh.GetPrim(), Usd.TimeCode.Default()) for mesh in (ball(), ball(), creased)]
    first, second, other = (refiner.Refiner(cage.control, 2) for cage in cages)
    assert first.control.topology is second.control.topology is not other.control.topology
    finer = refiner.Refiner(cages[0].control, 3)
    monkeypatch.setattr(refiner, "refine", lambda *_: pytest.fail("made again"))
    assert refiner.Refiner(cages[1].control, 2)._weights is first._weights is second._weights
    assert len({id(each._weights) for each in (first, other, finer)}) == 3


def test_left_handed_cages_keep_their_outside() -> None:
    mesh = define_mesh(CUBE_POINTS, [face[::-1] for face in CUBE_FACES], "catmullClark")
    mesh.CreateOrientationAttr("leftHanded")
    drawn = read(mesh, level=2)
    assert volume_of(drawn.mesh) > 0 and sharpest_turn(drawn) < 75 / 2**2


def test_a_crease_splits_normals_and_an_open_edge_stays_where_it_is() -> None:
    creased = ball()
    loop = [0, 1, 3, 2, 0]
    creased.CreateCreaseIndicesAttr(loop)
    creased.CreateCreaseLengthsAttr([len(loop)])
    creased.CreateCreaseSharpnessesAttr([10.0])
    smooth, sharp = read(ball(), level=3).mesh, read(creased, level=3).mesh
    assert len(sharp.points) > len(smooth.points)
    assert np.isclose(sharp.normals @ [-1, 0, 0], 1, atol=1e-6).sum() > np.isclose(smooth.normals[:, 0], -1).sum()
    sheet = read(define_mesh(GRID, GRID_FACES, "catmullClark"), level=2).mesh
    np.testing.assert_allclose(sheet.bounds, [[0, 0, 0], [2, 2, 0]], atol=1e-6)


def test_boundary_none_leaves_the_rim_out_and_holes_stay_open() -> None:
    open_sheet = define_mesh(GRID, GRID_FACES, "catmullClark")
    open_sheet.CreateInterpolateBoundaryAttr("none")
    assert not read(open_sheet, level=2).groups
    holed = ball()
    holed.CreateHoleIndicesAttr([4])
    drawn = read(holed, level=2)
    assert len(drawn.mesh.triangles) == 5 * 2 * 16 and 4 not in drawn.mesh.faces


def test_authored_faces_and_subsets_carry_through() -> None:
    mesh = ball()
    api = UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim())
    api.CreateMaterialBindSubset("lid", Vt.IntArray([2]), UsdGeom.Tokens.face)
    drawn = read(mesh, level=2)
    assert np.bincount(drawn.mesh.faces).tolist() == [32] * 6
    assert [(group.path, group.count) for group in drawn.groups] == [("/mesh", 5 * 32), ("/mesh/lid", 32)]


@pytest.mark.parametrize(
    ("interpolation", "count"), [("uniform", 6), ("vertex", 8), ("varying", 8), ("faceVarying", 24)]
)
def test_linear_primvars_stay_what_they_are(interpolation: str, count: int) -> None:
    """A colour that is the same everywhere stays the same, under every rule."""
    mesh = ball()
    set_primvar(mesh, "displayColor", [(0.25, 0.5, 0.75)] * count, interpolation)
    colors = read(mesh, level=3).mesh.display_color
    assert colors is not None
    np.testing.assert_allclose(colors, np.broadcast_to([0.25, 0.5, 0.75], colors.shape), atol=1e-6)


def test_vertex_primvars_follow_the_points() -> None:
    mesh = ball()
    set_primvar(mesh, "displayColor", Vt.Vec3fArray.FromNumpy(CUBE_POINTS), "vertex")
    drawn = read(mesh, level=2).mesh
    np.testing.assert_allclose(drawn.display_color, drawn.points, atol=1e-6)


@pytest.mark.parametrize("rule", ["none", "cornersOnly", "cornersPlus1", "cornersPlus2", "boundaries", "all"])
def test_coordinates_of_a_flat_sheet_follow_its_points(rule: str) -> None:
    """With corners pinned, the values' mesh is the sheet itself."""
    mesh = define_mesh(GRID, GRID_FACES, "catmullClark")
    mesh.CreateFaceVaryingLinearInterpolationAttr(rule)
    uv = np.array(GRID, np.float32)[np.ravel(GRID_FACES), :2]
    set_primvar(mesh, "st", Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(uv)), "faceVarying", "texCoord2f[]")
    drawn = read(mesh, level=2).mesh
    assert drawn.uvs["st"].min() >= 0 and drawn.uvs["st"].max() <= 2
    if rule not in ("none", "all"):
        np.testing.assert_allclose(drawn.uvs["st"], drawn.points[:, :2], atol=1e-5)
        assert len(drawn.points) == 81


def test_a_cut_in_the_coordinates_is_kept() -> None:
    mesh = define_mesh(GRID, GRID_FACES, "catmullClark")
    uv = np.array(GRID, np.float32)[np.ravel(GRID_FACES), :2]
    uv[8:] += 10
    set_primvar(mesh, "st", Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(uv)), "faceVarying", "texCoord2f[]")
    drawn = read(mesh, level=3).mesh
    inside = drawn.uvs["st"]
    assert ((inside <= 2 + 1e-5).all(axis=1) | (inside >= 10 - 1e-5).all(axis=1)).all()


@pytest.mark.parametrize(
    ("scheme", "attribute", "value", "reason"),
    [
        ("loop", None, None, "the Loop scheme takes triangles only"),
        ("catmullClark", "creaseLengths", [2], "creases need 2 vertex indices, got 0"),
        ("catmullClark", "cornerIndices", [99], "0 sharpnesses for 1 corners"),
    ],
)
def test_what_describes_no_surface_is_drawn_as_its_cage(scheme: str, attribute: str, value: list, reason: str) -> None:
    mesh = define_cube(scheme)
    if attribute:
        mesh.GetPrim().GetAttribute(attribute).Set(value)
    drawn = read(mesh, level=2)
    assert "drawn without subdivision: " + reason in reasons(drawn)[0]
    assert len(drawn.mesh.triangles) == 12 and drawn.mesh.level is None


def test_animated_creases_make_the_prim_vary() -> None:
    mesh = ball()
    assert not is_time_varying(mesh.GetPrim())
    mesh.CreateCornerSharpnessesAttr().Set([1.0], 1.0)
    mesh.GetCornerSharpnessesAttr().Set([2.0], 2.0)
    assert is_time_varying(mesh.GetPrim())


def test_moving_points_are_refined_by_the_same_stencils_and_still_ones_not_again() -> None:
    mesh = ball()
    for frame in (1, 2):
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(CUBE_POINTS * frame), frame)
    surfaces = [read_surface(mesh.GetPrim(), Usd.TimeCode(frame)) for frame in (1, 2)]
    memory = Tessellation()
    small = memory.at_level(surfaces[0], 3)
    refiner = memory._refiners["/mesh"]
    assert memory.at_level(surfaces[0], 3) is small
    large = memory.at_level(surfaces[1], 3)
    assert memory._refiners["/mesh"] is refiner
    np.testing.assert_allclose(large.mesh.points, 2 * small.mesh.points, rtol=1e-6)
    mesh.CreateCornerIndicesAttr([0])
    mesh.CreateCornerSharpnessesAttr([Gf.Vec2f(10, 0)[0]])
    memory.at_level(read_surface(mesh.GetPrim(), Usd.TimeCode(2)), 3)
    assert memory._refiners["/mesh"] is not refiner
