"""Polygons cut into triangles: once for a topology and what lies on it, then moved with its points."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, TypeGuard

import numpy as np

from defshade_cli.scene.geometry import Mesh
from defshade_cli.usd.polygons import Polygons, Primvar
from defshade_cli.usd.small_meshes import Shaped
from defshade_cli.usd.subsets import FaceGroup, Faces
from defshade_cli.usd.triangulation import triangulate


class Cut(NamedTuple):
    """Triangles of some polygons, sorted so that each material group is one run.

    polygons: what was cut.  split: points are one a corner, because something on the mesh splits them.
    issues: what was mended.
    """

    polygons: Polygons
    faces: Faces
    split: bool
    mesh: Mesh
    groups: tuple[FaceGroup, ...]
    issues: tuple[str, ...]

    def moved(self, polygons: Polygons, faces: Faces) -> Cut | None:
        """The same triangles at other points with other normals; None where more than those differ.

        A face that the pose folds keeps its cut, as where a rest shape is triangulated once.
        """
        if faces is not self.faces or not self._fits(polygons):
            return None
        whole = polygons.without_holes()
        assert whole.normals is not None
        normals = whole.join(whole.normals)
        if normals.splits_points and not self.split:
            return None
        points = whole.points[whole.indices] if self.split else whole.points
        at_vertices = whole.at_corners(normals) if self.split else whole.at_points(normals)
        return self._replace(polygons=polygons, mesh=replace(self.mesh, points=points, normals=at_vertices))

    def _fits(self, polygons: Polygons) -> bool:
        names = ("counts", "indices", "faces", "holes", "display_color", "display_opacity", "left_handed")
        same = all(getattr(polygons, name) is getattr(self.polygons, name) for name in names)
        named = (list(of.uvs.items()) + list(of.shown.items()) for of in (polygons, self.polygons))
        return same and next(named) == next(named)


def cut(
    polygons: Polygons, faces: Faces, path: str, shaped: Shaped | None = None, *, double_sided: bool = False
) -> Cut:
    """Triangles over the points, or over the corners where something on the mesh splits points.

    polygons: with normals, unless `shaped` has them.  shaped: what is known of them; they have no holes then.
    """
    if shaped and shaped.corners:
        known = shaped.corners
        mesh = Mesh(path, known.points, known.normals, known.triangles, known.faces, double_sided=double_sided)
        return Cut(polygons, faces, known.split, *faces.sort(mesh), ())
    issues: list[str] = []
    whole = polygons.without_holes().joined()
    corners, face = shaped.triangles if shaped else triangulate(whole, issues)
    if whole.left_handed:
        corners = corners[:, ::-1]
    split = any(primvar.splits_points for primvar in whole.primvars)
    place = whole.at_corners if split else whole.at_points
    color, opacity, normals = whole.display_color, whole.display_opacity, whole.normals
    assert normals is not None
    mesh = Mesh(
        path=path,
        points=whole.points[whole.indices] if split else whole.points,
        normals=place(normals),
        triangles=(corners if split else whole.indices[corners]).astype(np.uint32),
        faces=whole.faces[face],
        display_color=place(color) if varies(color) else None,
        display_opacity=place(opacity) if varies(opacity) else None,
        uvs={name: place(uv) for name, uv in whole.uvs.items()},
        primvars={name: place(primvar) for name, primvar in whole.shown.items()},
        double_sided=double_sided,
    )
    return Cut(polygons, faces, split, *faces.sort(mesh), tuple(issues))


def varies(primvar: Primvar | None) -> TypeGuard[Primvar]:
    """Does it differ over the mesh?"""
    return primvar is not None and primvar.interpolation != "constant"
