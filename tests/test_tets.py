"""TetMesh: the surface of tetrahedra, computed and authored."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import UsdGeom

from defshade_cli.usd.surfaces.varying import is_time_varying
from prims import new_stage, read, reasons, set_primvar

POINTS = [(-1, -1, 0), (1, -1, 0), (0, 1, 0), (0, 0, 2), (0, 0, -2)]
SURFACE = [(0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 4), (2, 1, 4), (1, 0, 4)]


def tets() -> UsdGeom.TetMesh:
    """Two tetrahedra that share a face."""
    schema = UsdGeom.TetMesh.Define(new_stage(), "/tets")
    schema.CreatePointsAttr(POINTS)
    schema.CreateTetVertexIndicesAttr([(0, 1, 2, 3), (1, 0, 2, 4)])
    return schema


@pytest.mark.parametrize("authored", [False, True])
def test_the_shared_face_is_within(authored: bool) -> None:
    """Six faces, of which the normals lead out of the solid, and whose corners wind around them."""
    schema = tets()
    if authored:
        schema.CreateSurfaceFaceVertexIndicesAttr(SURFACE)
    drawn = read(schema)
    a, b, c = drawn.mesh.points[drawn.mesh.triangles].swapaxes(0, 1)
    across = np.cross(b - a, c - a)
    assert len(across) == 6 and not drawn.issues
    assert (np.einsum("ti,ti->t", across, (a + b + c) / 3.0 - (0, -1 / 3, 0)) > 0).all()
    corners = drawn.mesh.normals[drawn.mesh.triangles[:, 0]]
    np.testing.assert_allclose(corners, across / np.linalg.norm(across, axis=1)[:, None], atol=1e-6)


def test_primvars_are_one_a_face_of_the_surface() -> None:
    schema = tets()
    schema.CreateSurfaceFaceVertexIndicesAttr(SURFACE)
    colors = [(number / 8, 0, 0) for number in range(6)]
    set_primvar(schema, "displayColor", colors, "uniform")
    drawn = read(schema)
    assert drawn.mesh.display_color is not None
    found = drawn.mesh.display_color[drawn.mesh.triangles[:, 0], 0]
    np.testing.assert_allclose(np.sort(found), np.arange(6) / 8)


def test_bad_indices_are_left_out_and_said() -> None:
    schema = tets()
    schema.CreateTetVertexIndicesAttr([(0, 1, 2, 3), (1, 0, 2, 9)])
    assert reasons(read(schema)) == ["3 faces are left out: their indices are out of range"]
    schema.CreateTetVertexIndicesAttr([])
    assert reasons(read(schema)) == ["it has no faces"]


def test_moving_points_make_it_vary() -> None:
    schema = tets()
    assert not is_time_varying(schema.GetPrim())
    for time in (1, 2):
        schema.GetPointsAttr().Set([(x, y, z * time) for x, y, z in POINTS], time)
    assert is_time_varying(schema.GetPrim())
