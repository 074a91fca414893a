"""What lies on a surface, asked with few questions and not looked into.

Of what is common nothing needs to be said, if it is sound. Where there is more to it, usd/polygons/primvars.py knows.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, Vt

from defshade_cli.usd.color_space import in_rec709, is_color
from defshade_cli.usd.polygons.end_to_end import each_finite, each_greatest
from defshade_cli.usd.polygons.polygons import Interpolation, Primvar
from defshade_cli.usd.polygons.primvars import Carried, Elements, uv_width
from defshade_cli.usd.said import Inherited, Said
from defshade_cli.usd.values import are_finite, floats

_PRIMVARS, _INDICES = "primvars:", ":indices"
_NORMALS, _NORMALS_INDICES = "primvars:normals", "primvars:normals:indices"
_CONSTANT: Interpolation = "constant"
_VERTEX: Interpolation = "vertex"

Field = Literal["normals", "display_color", "display_opacity", "uvs"]


class Lying(NamedTuple):
    """Values (N, ...) float32 on a mesh; (D, ...) distinct ones where `indices` (N,) tell which.

    field: of Polygons.  name: of texture coordinates.
    """

    field: Field
    name: str
    values: NDArray[np.float32]
    interpolation: Interpolation
    indices: NDArray[np.int32] | None = None

    @property
    def size(self) -> int:
        """N"""
        return len(self.values if self.indices is None else self.indices)

    @property
    def primvar(self) -> Primvar:
        """Its indices followed, which are in range."""
        return Primvar(self.values if self.indices is None else self.values[self.indices], self.interpolation)


MORE = Lying("normals", "", np.empty((0, 3), np.float32), "constant")
"""Stands for what needs to be looked into."""


def told_normals(said: Said, time: Usd.TimeCode) -> Lying | None:
    """Those that count, None without any; MORE where they are no vectors, or the same everywhere."""
    attribute, indices, fallback = said.properties.get(_NORMALS), said.properties.get(_NORMALS_INDICES), _CONSTANT
    if attribute is None:
        attribute, indices, fallback = said.properties.get("normals"), None, _VERTEX
    if attribute is None:
        return None
    if not isinstance(attribute, Usd.Attribute) or is_color(attribute):
        return MORE
    lying = _laid("normals", "", attribute, floats(attribute.Get(time), 3), indices, time, fallback)
    return MORE if lying.interpolation == _CONSTANT else lying


def sound_carried(said: Said, time: Usd.TimeCode, color: str, elements: Elements) -> Carried | None:
    """Colour, opacity and texture coordinates of a surface; None where something of them needs to be said."""
    lying = told_carried(said, time, color)
    if lying is None or not are_as_many(lying, elements) or not all(are_sound(lying)):
        return None
    return carried(lying)


def carried(lying: Iterable[Lying]) -> Carried:
    """Of what is sound."""
    uvs: dict[str, Primvar] = {}
    others: dict[str, Primvar] = {}
    for each in lying:
        if each.field == "uvs":
            uvs[each.name] = each.primvar
        else:
            others[each.field] = each.primvar
    return Carried(others.get("display_color"), others.get("display_opacity"), uvs)


def are_as_many(lying: Iterable[Lying], elements: Elements) -> bool:
    """Has each as many values as it needs?"""
    return not any(each.size != elements.get(each.interpolation, 0) for each in lying)


def are_sound(lying: Sequence[Lying]) -> list[bool]:
    """Are all values of each finite, and all indices at one of them? None is empty."""
    sound = each_finite([each.values for each in lying])
    indexed = [number for number, each in enumerate(lying) if each.indices is not None]
    if indexed:
        greatest = each_greatest([each.indices for each in lying if each.indices is not None]).tolist()
        for number, last in zip(indexed, greatest, strict=True):
            sound[number] &= last < len(lying[number].values)
    return sound


def told_carried(said: Said, time: Usd.TimeCode, color: str) -> tuple[Lying, ...] | None:
    """Colour, opacity and texture coordinates, its own or inherited; None where there is more to them."""
    handed_down = _inherited(said.inherited, time, color)
    if handed_down is None:
        return None
    found = {**handed_down}
    for name in said.lying:
        short = name[len(_PRIMVARS) :]
        lying = _lying(short, said.properties[name], said.properties.get(name + _INDICES), time, color)
        if lying is MORE or (lying is None and short in found):
            return None
        found[short] = lying
    return tuple([lying for lying in found.values() if lying])


_Found = Mapping[str, Lying | None]
_NOTHING_FOUND: _Found = {}


def _inherited(inherited: Inherited, time: Usd.TimeCode, color: str) -> _Found | None:
    """The same of what ancestors hand down, by name; made once for all that is below them."""
    if not inherited.primvars:
        return _NOTHING_FOUND
    key = time, color
    if key not in inherited.read:
        named = {str(primvar.GetPrimvarName()): primvar for primvar in inherited.primvars}
        named.pop("normals", None)
        attributes = [(name, p.GetAttr(), p.GetIndicesAttr() if p.IsIndexed() else None) for name, p in named.items()]
        found = {name: _lying(name, values, indices, time, color) for name, values, indices in attributes}
        inherited.read[key] = None if any(each is MORE for each in found.values()) else found
    known: _Found | None = inherited.read[key]
    return known


def _lying(
    name: str, attribute: Usd.Property, indices: Usd.Property | None, time: Usd.TimeCode, color: str
) -> Lying | None:
    """A primvar as that for which it counts; None of one that is not read, MORE where there is more to it."""
    if not isinstance(attribute, Usd.Attribute):
        return MORE
    value = attribute.Get(time)
    if name == color:
        return _lying_color(name, attribute, value, indices, time)
    if name == "displayOpacity":
        return _laid("display_opacity", name, attribute, floats(value, 1), indices, time)
    width = 2 if isinstance(value, Vt.Vec2fArray) else uv_width(attribute)
    if not width:
        return None
    values = floats(value, width)
    if values is not None and width == 3:
        values = values[:, :2] if are_finite(values) else None
    return _laid("uvs", name, attribute, values, indices, time)


def _lying_color(
    name: str, attribute: Usd.Attribute, value: object, indices: Usd.Property | None, time: Usd.TimeCode
) -> Lying:
    if uv_width(attribute):
        return MORE
    colors = in_rec709(attribute, value) if is_color(attribute) else value
    return _laid("display_color", name, attribute, floats(colors, 3), indices, time)


def _laid(
    field: Field,
    name: str,
    attribute: Usd.Attribute,
    values: NDArray[np.float32] | None,
    indices: Usd.Property | None,
    time: Usd.TimeCode,
    fallback: Interpolation = _CONSTANT,
) -> Lying:
    chosen = None if indices is None else indices.Get(time)
    if values is None or not len(values) or not (indices is None or isinstance(chosen, Vt.IntArray)):
        return MORE
    interpolation = attribute.GetMetadata("interpolation") or fallback
    return Lying(field, name, values, interpolation, None if chosen is None else np.asarray(chosen))
