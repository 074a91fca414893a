"""What a surface prim is by its type: how its shape is read, and which attributes it is read from.

What reads prims of one type alone is imported where there are such.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from pxr import Usd, UsdGeom

from defshade_cli.usd.gprims.copies import Copies
from defshade_cli.usd.gprims.gprims import Solid, read_solid, size_attributes
from defshade_cli.usd.polygons.control import CONTROL_ATTRIBUTES
from defshade_cli.usd.polygons.mesh import MESH_ATTRIBUTES, read_mesh
from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.said import Said

if TYPE_CHECKING:
    from defshade_cli.usd.curves.strands import Strands


class Shape(NamedTuple):
    """What a prim is before its materials count; copies, solid and strands as in Surface."""

    polygons: Polygons
    copies: Copies | None = None
    solid: Solid | None = None
    strands: Strands | None = None


def read_shape(
    prim: Usd.Prim, said: Said, time: Usd.TimeCode, issues: list[str], color: str, as_cages: bool
) -> Shape | None:
    """None for a type that is no supported surface."""
    solid = read_solid(prim, said, time, issues, color, as_cage=as_cages)
    if solid is not None:
        return Shape(solid[0], solid=solid[1])
    if said.type_name == "Mesh" or prim.IsA(UsdGeom.Mesh):
        return Shape(read_mesh(prim, said, time, issues, color))
    if prim.IsA(UsdGeom.Points):
        from defshade_cli.usd.gprims.points import read_points

        return Shape(*read_points(UsdGeom.Points(prim), time, issues, color, as_disks=as_cages))
    if prim.IsA(UsdGeom.BasisCurves):
        from defshade_cli.usd.curves.curves import read_curves

        return _along(read_curves(UsdGeom.BasisCurves(prim), time, issues, color))
    if prim.IsA(UsdGeom.NurbsCurves):
        from defshade_cli.usd.curves.nurbs_curves import read_nurbs_curves

        return _along(read_nurbs_curves(UsdGeom.NurbsCurves(prim), time, issues, color))
    if prim.IsA(UsdGeom.TetMesh):
        from defshade_cli.usd.polygons.tets import read_tets

        return Shape(read_tets(prim, said, time, issues, color))
    if prim.IsA(UsdGeom.NurbsPatch):
        from defshade_cli.usd.nurbs.nurbs import read_patch

        return Shape(read_patch(UsdGeom.NurbsPatch(prim), time, issues, color))
    return None


def _along(strands: Strands) -> Shape:
    from defshade_cli.usd.curves.sweep import swept

    return Shape(swept(strands), strands=strands)


def attributes_of(prim: Usd.Prim) -> tuple[str, ...]:
    """What is read of a prim and may vary over time, besides primvars."""
    if prim.IsA(UsdGeom.Mesh):
        return MESH_ATTRIBUTES + CONTROL_ATTRIBUTES
    if prim.IsA(UsdGeom.Points):
        from defshade_cli.usd.gprims.points import POINTS_ATTRIBUTES

        return POINTS_ATTRIBUTES
    if prim.IsA(UsdGeom.BasisCurves):
        from defshade_cli.usd.curves.curves import CURVES_ATTRIBUTES

        return CURVES_ATTRIBUTES
    if prim.IsA(UsdGeom.NurbsCurves):
        from defshade_cli.usd.curves.nurbs_curves import NURBS_CURVES_ATTRIBUTES

        return NURBS_CURVES_ATTRIBUTES
    if prim.IsA(UsdGeom.TetMesh):
        from defshade_cli.usd.polygons.tets import TETS_ATTRIBUTES

        return TETS_ATTRIBUTES
    if prim.IsA(UsdGeom.NurbsPatch):
        from defshade_cli.usd.nurbs.nurbs import PATCH_ATTRIBUTES

        return PATCH_ATTRIBUTES
    return size_attributes(prim)
