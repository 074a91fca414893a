"""Any surface prim of a stage as one triangulated scene.Mesh.

prim ── mesh | gprims ──→ Polygons ──→ Surface      what is authored, read once
Surface ── refiner ── normals ── cut ──→ Gprim      as finely as the picture needs

What reads prims of one type alone is imported where there are such.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.geometry import Mesh
from defshade_cli.scene.scene import Unsupported
from defshade_cli.usd.gprims.copies import Copies
from defshade_cli.usd.gprims.gprims import read_solid, size_attributes
from defshade_cli.usd.polygons.control import CONTROL_ATTRIBUTES, Control, read_control, smooth_control
from defshade_cli.usd.polygons.cut import Cut, cut
from defshade_cli.usd.polygons.mesh import MESH_ATTRIBUTES, read_mesh
from defshade_cli.usd.polygons.normals import with_normals
from defshade_cli.usd.polygons.polygons import Polygons, Primvar, varying
from defshade_cli.usd.polygons.positions import is_carried_by_velocities, read_positions
from defshade_cli.usd.polygons.primvars import (
    DISPLAY_COLOR,
    Elements,
    count_elements,
    find_primvars,
    read_shown,
    uv_width,
)
from defshade_cli.usd.polygons.shapes import Shapes
from defshade_cli.usd.polygons.small_meshes import Shaped
from defshade_cli.usd.polygons.subsets import FaceGroup, Faces, material_subsets, read_faces
from defshade_cli.usd.said import Said, said_of
from defshade_cli.usd.sharing import shared

if TYPE_CHECKING:
    from defshade_cli.usd.curves.strands import Strands
    from defshade_cli.usd.polygons.refiner import Refiner

__all__ = ["FaceGroup", "Gprim", "Surface", "is_time_varying", "read_surface", "tessellate"]


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface prim at one time, in object space, before it is cut into triangles.

    path: by which the prim is known.
    polygons: the surface, or the cage that `control` makes one of.
    copies: where the prim places it; None for once, as it is.
    faces: which material group each authored face is in.
    display_color: (3,) float32, the constant authored or inherited value; None where there is none, or where it
        varies and lies on the polygons. display_opacity likewise.
    groups: paths of the material groups that have faces to draw, in order.
    issues: what was left out or mended of this prim, and why.
    strands: of curves, from which the polygons follow, or others that face the image.
    """

    path: str
    polygons: Polygons
    control: Control | None
    faces: Faces
    groups: tuple[str, ...]
    double_sided: bool
    copies: Copies | None
    display_color: NDArray[np.float32] | None
    display_opacity: float | None
    issues: tuple[Unsupported, ...]
    strands: Strands | None = None


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Gprim:
    """A surface as triangles.

    mesh: triangles sorted so that each group is one run.
    groups: cover every triangle, in the order of Surface.groups; those that refinement left empty are missing.
    issues: what was mended on the way, and why.
    cut: how the triangles were made.
    """

    mesh: Mesh
    groups: tuple[FaceGroup, ...]
    issues: tuple[Unsupported, ...]
    cut: Cut


def read_surface(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    color: str = DISPLAY_COLOR,
    shown: tuple[str, ...] = (),
    shapes: Shapes | None = None,
    *,
    as_cages: bool = False,
    said: Said | None = None,
    subsets: list[UsdGeom.Subset] | None = None,
) -> Surface | None:
    """The surface of `prim`; None for a type that is no supported surface. Bad data becomes issues, never raises.

    A surface of which nothing can be drawn has no groups, and issues that say why.
    color: primvar to take for displayColor.  shown: primvars for layers.
    shapes: of other prims, whose polygons it shares where they are equal.  as_cages: see Memory.
    said, subsets: of the prim, where they are known, see subsets.material_subsets.
    """
    issues: list[str] = []
    said = said or said_of(prim)
    shape = _read_shape(prim, said, time, issues, color, as_cages)
    if shape is None:
        return None
    if shown:
        read = read_shown(prim, shown, time, _elements(shape.polygons), issues)
        shape = shape._replace(polygons=replace(shape.polygons, shown=read))
    return surface_of(prim, said, time, shape, shapes, subsets, issues)


class Shape(NamedTuple):
    """What a prim is before its materials count; copies and strands as in Surface."""

    polygons: Polygons
    copies: Copies | None = None
    strands: Strands | None = None


def surface_of(
    prim: Usd.Prim,
    said: Said,
    time: Usd.TimeCode,
    shape: Shape,
    shapes: Shapes | None,
    subsets: list[UsdGeom.Subset] | None,
    issues: list[str],
) -> Surface:
    """Of a prim whose shape is known; arguments as of read_surface. issues: what is said of it already."""
    path, (polygons, copies, strands) = said.path, shape
    display_color, opacity = _constant(polygons.display_color), _constant(polygons.display_opacity)
    if shapes is not None:
        polygons = shapes.shared(polygons.without_constants())
    mesh = None if polygons.scheme == "none" else UsdGeom.Mesh(prim)
    control = read_control(mesh, said, polygons, time, issues) if mesh else smooth_control(polygons)
    faces = read_faces(said, material_subsets(prim) if subsets is None else subsets, time, issues)
    return Surface(
        path=path,
        polygons=polygons,
        control=control,
        faces=faces,
        groups=faces.groups_of(polygons.drawn_faces) if copies is None or len(copies.ids) else (),
        double_sided=_is_double_sided(prim, said),
        copies=copies,
        display_color=display_color,
        display_opacity=None if opacity is None else float(opacity),
        issues=tuple([Unsupported(path, issue) for issue in issues]),
        strands=strands,
    )


def _elements(polygons: Polygons) -> Elements:
    """Of polygons as they were read; values of faces and corners fit none from which broken faces were left out."""
    whole = np.array_equal(polygons.faces, np.arange(len(polygons.counts)))
    return count_elements(whole * len(polygons.counts), len(polygons.points), whole * len(polygons.indices))


def tessellate(
    surface: Surface,
    refiner: Refiner | None = None,
    last: Gprim | None = None,
    shaped: Shaped | None = None,
    *,
    level: int = 0,
) -> Gprim:
    """The surface in triangles; without a refiner its cage.

    last: an earlier one, of which is kept what fits.
    shaped: what is known of it, refined `level` times, and then taken whole.
    """
    if shaped:
        refined, last = shaped.polygons, None
    else:
        refined = with_normals(refiner.refine(surface.polygons) if refiner else surface.polygons)
    polygons = shared(refined, last.cut.polygons) if last else refined
    sides, refined_to = surface.double_sided, (refiner.level if refiner else level) if surface.control else None
    known = last.cut.moved(polygons, surface.faces) if last else None
    made = known or cut(polygons, surface.faces, surface.path, shaped, double_sided=sides, level=refined_to)
    mesh = made.mesh
    if (mesh.double_sided, mesh.level) != (sides, refined_to):
        mesh = replace(mesh, double_sided=sides, level=refined_to)
    return Gprim(mesh, made.groups, tuple([Unsupported(surface.path, issue) for issue in made.issues]), made)


def move_surface(
    surface: Surface, prim: Usd.Prim, time: Usd.TimeCode, base: Usd.TimeCode | None = None
) -> Surface | None:
    """The same with the points of another time, as read_positions has them; None where they do not fit what stays."""
    polygons = surface.polygons
    points = read_positions(prim, time, base)
    if points is None or points.shape != polygons.points.shape or not np.isfinite(points[polygons.indices]).all():
        return None
    return replace(surface, polygons=replace(polygons, points=points))


def only_points_vary(prim: Usd.Prim, color: str = DISPLAY_COLOR, shown: tuple[str, ...] = ()) -> bool:
    """Is a mesh, if anything of it varies, the same but for its points?"""
    return prim.IsA(UsdGeom.Mesh) and varying_names(prim, color, shown) <= {"points", "velocities", "accelerations"}


def is_time_varying(
    prim: Usd.Prim, color: str = DISPLAY_COLOR, shown: tuple[str, ...] = (), said: Said | None = None
) -> bool:
    """Whether anything that is read of the prim has more than one value over time."""
    return bool(varying_names(prim, color, shown, said))


def varying_names(
    prim: Usd.Prim, color: str = DISPLAY_COLOR, shown: tuple[str, ...] = (), said: Said | None = None
) -> set[str]:
    """Of what read_surface reads, primvars inherited and face subsets included, what may differ over time."""
    said = said or said_of(prim)
    attributes = (prim.GetAttribute(name) for name in _attributes(prim) if name in said.names)
    subsets = (subset.GetIndicesAttr() for subset in material_subsets(prim))
    sources = (*attributes, *(_carried(prim, color, shown) if said.primvars else ()), *subsets)
    names = {str(source.GetName()) for source in sources if source and source.ValueMightBeTimeVarying()}
    return names | {"velocities"} if _moves_by_velocities(prim, said) else names


def _moves_by_velocities(prim: Usd.Prim, said: Said) -> bool:
    may = "velocities" in said.names and prim.IsA(UsdGeom.PointBased)
    return may and is_carried_by_velocities(prim, Usd.TimeCode(0.0))


def _carried(prim: Usd.Prim, color: str, shown: tuple[str, ...]) -> Iterator[UsdGeom.Primvar]:
    """The primvars that may be read of it, see primvars.read_carried."""
    api = UsdGeom.PrimvarsAPI(prim)
    yield from (api.GetPrimvar(name) for name in ("normals", "widths"))
    yield from (api.FindPrimvarWithInheritance(name) for name in shown)
    found = find_primvars(prim).items()
    yield from (p for name, p in found if name in (color, "displayOpacity") or uv_width(p))


def _read_shape(
    prim: Usd.Prim, said: Said, time: Usd.TimeCode, issues: list[str], color: str, as_cages: bool
) -> Shape | None:
    """None for a type that is no supported surface."""
    solid = read_solid(prim, said, time, issues, color, as_cage=as_cages)
    if solid is not None:
        return Shape(solid)
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
    if prim.IsA(UsdGeom.NurbsPatch):
        from defshade_cli.usd.nurbs.nurbs import read_patch

        return Shape(read_patch(UsdGeom.NurbsPatch(prim), time, issues, color))
    return None


def _along(strands: Strands) -> Shape:
    from defshade_cli.usd.curves.sweep import swept

    return Shape(swept(strands), strands=strands)


def _is_double_sided(prim: Usd.Prim, said: Said) -> bool:
    """Planes are, unless they say otherwise."""
    if "doubleSided" in said.names:
        return bool(prim.GetAttribute("doubleSided").Get())
    return _doubles_sides(said.type_name)


@cache
def _doubles_sides(type_name: str) -> bool:
    """By the schema of a type."""
    definition = Usd.SchemaRegistry().FindConcretePrimDefinition(type_name)
    return bool(definition and definition.GetAttributeFallbackValue("doubleSided"))


def _attributes(prim: Usd.Prim) -> tuple[str, ...]:
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
    if prim.IsA(UsdGeom.NurbsPatch):
        from defshade_cli.usd.nurbs.nurbs import PATCH_ATTRIBUTES

        return PATCH_ATTRIBUTES
    return size_attributes(prim)


def _constant(primvar: Primvar | None) -> NDArray[np.float32] | None:
    return None if primvar is None or varying(primvar) else primvar.values[0]
