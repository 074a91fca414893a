"""Polygons cut into triangles: once for a topology and what lies on it, then moved with its points."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from defshade_cli.scene.geometry import Mesh
from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.polygons.small_meshes import Shaped
from defshade_cli.usd.polygons.subsets import FaceGroup, Faces
from defshade_cli.usd.polygons.triangulation import triangulate
from defshade_cli.usd.polygons.vertices import vertices_of


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
    polygons: Polygons,
    faces: Faces,
    path: str,
    shaped: Shaped | None = None,
    *,
    double_sided: bool = False,
    level: int | None = None,
) -> Cut:
    """Triangles over the points, or over the corners where something on the mesh splits points.

    polygons: with normals, unless `shaped` is known of them.  double_sided, level: see scene.Mesh.
    """
    issues: list[str] = []
    if shaped:
        drawn = shaped.vertices
    else:
        whole = polygons.without_holes().joined()
        drawn = vertices_of(whole, triangulate(whole, issues))
    drawn, groups = faces.sort(drawn)
    mesh = drawn.mesh(path, double_sided=double_sided, level=level)
    return Cut(polygons, faces, drawn.split, mesh, groups, tuple(issues))
