"""Any surface prim of a stage as one triangulated scene.Mesh.

prim ── mesh | gprims ──→ Polygons ──→ Surface      what is authored, read once
Surface ── refiner ── normals ── cut ──→ Gprim      as finely as the picture needs

shape says what is read of a prim by its type, varying what of it may change over time.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.geometry import Mesh
from defshade_cli.scene.scene import Unsupported
from defshade_cli.usd.gprims.copies import Copies
from defshade_cli.usd.gprims.gprims import Solid
from defshade_cli.usd.polygons.control import Control, read_control, smooth_control
from defshade_cli.usd.polygons.cut import Cut, cut
from defshade_cli.usd.polygons.normals import with_normals
from defshade_cli.usd.polygons.polygons import Polygons, Primvar, varying
from defshade_cli.usd.polygons.positions import read_positions
from defshade_cli.usd.polygons.primvars import (
    DISPLAY_COLOR,
    Elements,
    count_elements,
    read_shown,
)
from defshade_cli.usd.polygons.shapes import Shapes
from defshade_cli.usd.polygons.small_meshes import Shaped
from defshade_cli.usd.polygons.subsets import FaceGroup, Faces, material_subsets, read_faces
from defshade_cli.usd.said import Said, said_of
from defshade_cli.usd.sharing import shared
from defshade_cli.usd.surfaces.shape import Shape, read_shape

if TYPE_CHECKING:
    from defshade_cli.usd.curves.strands import Strands
    from defshade_cli.usd.polygons.refiner import Refiner

__all__ = ["FaceGroup", "Gprim", "Surface", "read_surface", "tessellate"]


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
    solid: what the polygons are of, if that is round.
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
    solid: Solid | None = None


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
    shape = read_shape(prim, said, time, issues, color, as_cages)
    if shape is None:
        return None
    if shown:
        read = read_shown(prim, shown, time, _elements(shape.polygons), issues)
        shape = shape._replace(polygons=replace(shape.polygons, shown=read))
    return surface_of(prim, said, time, shape, shapes, subsets, issues)


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
    path, (polygons, copies, solid, strands) = said.path, shape
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
        solid=solid,
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
    """The surface in triangles; without a refiner its cage, and a solid as coarse as its level says.

    last: an earlier one, of which is kept what fits.
    shaped: what is known of it, refined `level` times, and then taken whole.
    """
    if shaped:
        refined, last = shaped.polygons, None
    else:
        refined = with_normals(refiner.refine(surface.polygons) if refiner else _coarse(surface, -min(level, 0)))
    polygons = shared(refined, last.cut.polygons) if last else refined
    is_refined = surface.control is not None or level < 0
    sides, refined_to = surface.double_sided, (refiner.level if refiner else level) if is_refined else None
    known = last.cut.moved(polygons, surface.faces) if last else None
    made = known or cut(polygons, surface.faces, surface.path, shaped, double_sided=sides, level=refined_to)
    mesh = made.mesh
    if (mesh.double_sided, mesh.level) != (sides, refined_to):
        mesh = replace(mesh, double_sided=sides, level=refined_to)
    return Gprim(mesh, made.groups, tuple([Unsupported(surface.path, issue) for issue in made.issues]), made)


def _coarse(surface: Surface, halvings: int) -> Polygons:
    """Its polygons; of a solid with fewer segments, and what is the same all over it."""
    if not halvings or not surface.solid:
        return surface.polygons
    solid = surface.solid.polygons(halvings)
    shape = {name: getattr(solid, name) for name in ("points", "counts", "indices", "faces", "normals")}
    return replace(surface.polygons, **shape)


def move_surface(
    surface: Surface, prim: Usd.Prim, time: Usd.TimeCode, base: Usd.TimeCode | None = None
) -> Surface | None:
    """The same with the points of another time, as read_positions has them; None where they do not fit what stays."""
    polygons = surface.polygons
    points = read_positions(prim, time, base)
    if points is None or points.shape != polygons.points.shape or not np.isfinite(points[polygons.indices]).all():
        return None
    return replace(surface, polygons=replace(polygons, points=points))


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


def _constant(primvar: Primvar | None) -> NDArray[np.float32] | None:
    return None if primvar is None or varying(primvar) else primvar.values[0]
