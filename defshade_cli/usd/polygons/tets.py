"""UsdGeom.TetMesh → Polygons: the faces that no two tetrahedra share, which are its surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.usd.polygons.mesh import normals_of, points_of, without_broken_faces
from defshade_cli.usd.polygons.normals import mend_normals
from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.polygons.primvars import DISPLAY_COLOR, count_elements, read_carried
from defshade_cli.usd.said import Said

TETS_ATTRIBUTES = ("points", "tetVertexIndices", "surfaceFaceVertexIndices", "normals")
"""What is read of a TetMesh that may vary over time, besides primvars."""


def read_tets(
    prim: Usd.Prim, said: Said, time: Usd.TimeCode, issues: list[str], color: str = DISPLAY_COLOR
) -> Polygons:
    """Triangles; primvars that are one a face or a corner count those of the surface. Bad data becomes issues."""
    points = points_of(prim, said, time, issues)
    triangles = _surface(UsdGeom.TetMesh(prim), time)
    if not len(triangles):
        issues.append("it has no faces")
    if not len(points):
        triangles = triangles[:0]
    elements = count_elements(len(triangles), len(points), triangles.size)
    polygons = Polygons(
        points=points,
        counts=np.full(len(triangles), 3),
        indices=triangles.ravel(),
        faces=np.arange(len(triangles), dtype=np.int32),
        left_handed=prim.GetAttribute("orientation").Get() == UsdGeom.Tokens.leftHanded,
        normals=normals_of(prim, said, time, elements, issues),
        **read_carried(prim, time, elements, issues, color)._asdict(),
    )
    return mend_normals(without_broken_faces(polygons, issues), issues)


def _surface(tets: UsdGeom.TetMesh, time: Usd.TimeCode) -> NDArray[np.integer]:
    """(F, 3) as authored, or as USD finds it."""
    authored = tets.GetSurfaceFaceVertexIndicesAttr().Get(time)
    found = authored if authored is not None and len(authored) else UsdGeom.TetMesh.ComputeSurfaceFaces(tets, time)
    return np.asarray(found if found is not None else [], np.int32).reshape(-1, 3)
