"""What of a surface prim changes over time, as far as it is read."""

from __future__ import annotations

from collections.abc import Iterator

from pxr import Usd, UsdGeom

from defshade_cli.usd.polygons.positions import is_carried_by_velocities
from defshade_cli.usd.polygons.primvars import DISPLAY_COLOR, find_primvars, uv_width
from defshade_cli.usd.polygons.subsets import material_subsets
from defshade_cli.usd.said import Said, said_of
from defshade_cli.usd.surfaces.shape import attributes_of

_OF_POINTS = {"points", "velocities", "accelerations"}


def only_points_vary(
    prim: Usd.Prim, color: str = DISPLAY_COLOR, shown: tuple[str, ...] = (), said: Said | None = None
) -> bool:
    """Is a mesh, if anything of it varies, the same but for its points?"""
    return prim.IsA(UsdGeom.Mesh) and varying_names(prim, color, shown, said) <= _OF_POINTS


def is_time_varying(
    prim: Usd.Prim, color: str = DISPLAY_COLOR, shown: tuple[str, ...] = (), said: Said | None = None
) -> bool:
    """Whether anything that is read of the prim has more than one value over time."""
    return bool(varying_names(prim, color, shown, said))


def varying_names(
    prim: Usd.Prim, color: str = DISPLAY_COLOR, shown: tuple[str, ...] = (), said: Said | None = None
) -> set[str]:
    """Of what read_surface reads, primvars inherited and face subsets included, what may differ over time.

    said: of the prim, without which nothing counts that value clips alone say.
    """
    said = said or said_of(prim)
    attributes = (prim.GetAttribute(name) for name in attributes_of(prim) if name in said.names)
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
