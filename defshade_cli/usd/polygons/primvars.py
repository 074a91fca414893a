"""Primvars: read, checked against the topology, their indices resolved."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.color_space import in_rec709, is_color
from defshade_cli.usd.polygons.polygons import Interpolation, Polygons, Primvar
from defshade_cli.usd.values import floats, integers

DISPLAY_COLOR = "displayColor"

Elements = Mapping[str, int]
"""How many values each interpolation needs."""

_UV_WIDTHS = {Sdf.ValueTypeNames.Find(f"texCoord{width}{kind}"): width for width in (2, 3) for kind in "fdh"}
_UV_WIDTHS |= {Sdf.ValueTypeNames.Find(name): 2 for name in ("float2", "double2", "half2")}
_UV_WIDTHS |= {scalar.arrayType: width for scalar, width in _UV_WIDTHS.items()}
"""Numbers a value of what may be texture coordinates. Of three the first two count."""


@dataclass(frozen=True, slots=True)
class Authored:
    """What a primvar, or an attribute like one, says: nothing of it is checked."""

    name: str
    value: object
    interpolation: str
    indices: object | None = None


OUT_OF_RANGE = "its indices are out of range"


class Carried(NamedTuple):
    """What lies on a surface beside its normals; the fields are those of Polygons."""

    display_color: Primvar | None = None
    display_opacity: Primvar | None = None
    uvs: Mapping[str, Primvar] = MappingProxyType({})

    def laid_on(self, polygons: Polygons) -> Polygons:
        """The polygons with these primvars."""
        return polygons if self is NOTHING_CARRIED else replace(polygons, **self._asdict())

    def mapped(self, change: Callable[[Primvar], Primvar]) -> Carried:
        """The same with every primvar changed."""
        color, opacity = (primvar and change(primvar) for primvar in (self.display_color, self.display_opacity))
        return Carried(color, opacity, {name: change(uv) for name, uv in self.uvs.items()})


NOTHING_CARRIED = Carried()


def count_elements(faces: int, points: int, corners: int) -> Elements:
    """How many values a primvar has by its interpolation."""
    return {"constant": 1, "uniform": faces, "varying": points, "vertex": points, "faceVarying": corners}


def authored(primvar: UsdGeom.Primvar | None, time: Usd.TimeCode) -> Authored | None:
    """The primvar's values, colours in linear Rec.709; None where nothing is authored."""
    if not primvar or not primvar.HasValue():
        return None
    indices = primvar.GetIndices(time) if primvar.IsIndexed() else None
    attribute, value = primvar.GetAttr(), primvar.Get(time)
    colors = in_rec709(attribute, value) if is_color(attribute) else value
    return Authored(str(primvar.GetName()), colors, primvar.GetInterpolation(), indices)


def find_display(prim: Usd.Prim, name: str) -> UsdGeom.Primvar:
    """displayColor, displayOpacity or what is read in their place: the prim's own, or an ancestor's constant."""
    return UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)


def find_primvars(prim: Usd.Prim) -> dict[str, UsdGeom.Primvar]:
    """What lies on a surface, by name: its own primvars with a value, and constant ones of its ancestors.

    USD does not list those that the schema has and value clips alone give values.
    """
    api = UsdGeom.PrimvarsAPI(prim)
    found = {str(p.GetPrimvarName()): p for p in api.FindPrimvarsWithInheritance()}
    own = {name: api.GetPrimvar(name) for name in (DISPLAY_COLOR, "displayOpacity") if name not in found}
    return found | {name: primvar for name, primvar in own.items() if primvar and primvar.HasValue()}


def uv_width(attribute: UsdGeom.Primvar | Usd.Attribute) -> int:
    """Numbers a value of what has a type that texture coordinates have; 0 of anything else."""
    return _UV_WIDTHS.get(attribute.GetTypeName(), 0)


def read_carried(
    prim: Usd.Prim, time: Usd.TimeCode, elements: Elements, issues: list[str], color: str = DISPLAY_COLOR
) -> Carried:
    """Colour, opacity and texture coordinates, those that fit and are finite. color: primvar that holds the colour."""
    found = find_primvars(prim)
    if not found:
        return NOTHING_CARRIED
    colors = _fit_finite(authored(found.get(color), time), 3, elements, issues)
    opacity = _fit_finite(authored(found.get("displayOpacity"), time), 1, elements, issues)
    uvs = {n: _read_uvs(p, w, time, elements, issues) for n, p in found.items() if (w := uv_width(p))}
    return Carried(colors, opacity, {name: primvar for name, primvar in uvs.items() if primvar is not None})


def _read_uvs(
    primvar: UsdGeom.Primvar, width: int, time: Usd.TimeCode, elements: Elements, issues: list[str]
) -> Primvar | None:
    uvs = _fit_finite(authored(primvar, time), width, elements, issues)
    return uvs if uvs is None or width == 2 else replace(uvs, values=uvs.values[:, :2])


def read_display(
    prim: Usd.Prim, name: str, width: int, time: Usd.TimeCode, elements: Elements, issues: list[str]
) -> Primvar | None:
    """displayColor, displayOpacity or what is read in their place, all finite; None where there is none that fits."""
    return _fit_finite(authored(find_display(prim, name), time), width, elements, issues)


def fit(source: Authored | None, width: int, elements: Elements, issues: list[str]) -> Primvar | None:
    """A primvar of `width` floats a value. One that is too long is cut; one that cannot be used is left out.

    Nothing authored, and an empty array, are no issue.
    """
    if source is None or source.value is None:
        return None
    values = _resolved(source, width)
    if isinstance(values, str):
        issues.append(f"{source.name} is left out: {values}")
        return None
    if not len(values):
        return None
    needed = elements.get(source.interpolation, 0)
    if len(values) != needed:
        found = f"{source.name} has {len(values)} {source.interpolation} values where {needed} are due"
        issues.append(f"{found}: {'the first are taken' if 0 < needed < len(values) else 'it is left out'}")
    if not 0 < needed <= len(values):
        return None
    return Primvar(values[:needed], cast(Interpolation, source.interpolation))


def _fit_finite(source: Authored | None, width: int, elements: Elements, issues: list[str]) -> Primvar | None:
    primvar = fit(source, width, elements, issues)
    if source is None or primvar is None or np.isfinite(primvar.values).all():
        return primvar
    issues.append(f"{source.name} is left out: not all of its values are finite")
    return None


def _resolved(source: Authored, width: int) -> NDArray[np.float32] | str:
    """The values with their indices followed, or why that cannot be."""
    values = floats(source.value, width)
    if values is None:
        return f"its type is not {width} floats a value"
    at_indices = followed(values, source.indices)
    return OUT_OF_RANGE if at_indices is None else at_indices


def followed(values: NDArray[Any], indices: object | None) -> NDArray[Any] | None:
    """The values (N, ...) at indices, or as they are without any; None where indices are out of range."""
    if indices is None:
        return values
    found = integers(indices)
    if found is None or (len(found) and not 0 <= found.min() <= found.max() < len(values)):
        return None
    return values[found]


def read_shown(
    prim: Usd.Prim, names: Iterable[str], time: Usd.TimeCode, elements: Elements, issues: list[str]
) -> dict[str, Primvar]:
    """The primvars that layers show, by name: one to four numbers a value, (N, 1 to 4)."""
    read = {}
    for name in names:
        source = authored(UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name), time)
        width = _width(source)
        primvar = _fit_finite(source, width, elements, issues) if width else None
        if primvar is not None:
            read[name] = replace(primvar, values=primvar.values.reshape(len(primvar.values), -1))
        elif source is not None and not width:
            issues.append(f"{source.name} is left out: no layer shows its type")
    return read


def _width(source: Authored | None) -> int:
    """Numbers in a value, 0 for what is none, or more than four."""
    array = np.asarray(None if source is None else source.value)
    if array.dtype.kind not in "iufb" or array.ndim > 2:
        return 0
    width = array.shape[-1] if array.ndim == 2 else 1
    return width if width <= 4 else 0
