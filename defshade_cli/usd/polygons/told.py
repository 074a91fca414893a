"""What a small mesh says, asked with few questions and not looked into: that is done for many at once, see checked.py.

Only meshes whose attributes have the types that are usual are asked so, and only where nothing needs to be said of
them but what is so common that it pays. All others are for usd/polygons/mesh.py, which knows what is wrong with them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom, Vt

from defshade_cli.usd.color_space import in_rec709, is_color
from defshade_cli.usd.polygons.end_to_end import LARGEST
from defshade_cli.usd.polygons.mesh import sizes_of
from defshade_cli.usd.polygons.polygons import SCHEMES, Interpolation, Primvar, Scheme
from defshade_cli.usd.polygons.primvars import uv_width
from defshade_cli.usd.said import Inherited, Said
from defshade_cli.usd.values import are_finite, floats, integers

_PRIMVARS, _INDICES = "primvars:", ":indices"
_CONSTANT: Interpolation = "constant"
_VERTEX: Interpolation = "vertex"
_RARE = frozenset({"velocities", "primvars:normals:indices"})
_TYPES = Sdf.ValueTypeNames
_NORMALS = frozenset({_TYPES.Normal3fArray, _TYPES.Float3Array, _TYPES.Vector3fArray})
_ALWAYS = Usd.TimeCode.Default()
"""Of what does not vary."""

_NO_HOLES = np.empty(0, np.int32)


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
    def primvar(self) -> Primvar:
        """Its indices followed, which are in range."""
        return Primvar(self.values if self.indices is None else self.values[self.indices], self.interpolation)


class Told(NamedTuple):
    """Of a mesh what the fields of Polygons of these names hold, unless it is not sound. Only holes may be empty."""

    points: NDArray[np.float32]
    counts: NDArray[np.integer]
    indices: NDArray[np.int32]
    faces: NDArray[np.int32]
    holes: NDArray[np.integer]
    scheme: Scheme
    left_handed: bool
    normals: Lying | None
    carried: tuple[Lying, ...]


_MORE = Lying("normals", "", np.empty((0, 3), np.float32), "constant")
"""Stands for what needs to be looked into."""


def told_of(said: Said, time: Usd.TimeCode, color: str) -> Told | None:
    """None where there is more to it. color: as read_surface has it."""
    names = said.names
    if not _RARE.isdisjoint(names):
        return None
    indices = said.value("faceVertexIndices", time)
    if not isinstance(indices, Vt.IntArray) or not 0 < len(indices) <= LARGEST:
        return None
    counts, points = said.value("faceVertexCounts", time), said.value("points", time)
    if not (isinstance(counts, Vt.IntArray) and isinstance(points, Vt.Vec3fArray) and counts and points):
        return None
    scheme = said.value("subdivisionScheme", _ALWAYS) if "subdivisionScheme" in names else "catmullClark"
    sizes = sizes_of(np.asarray(counts))
    if scheme not in SCHEMES or sizes.corners != len(indices):
        return None
    normals = _normals(said, time) if scheme == "none" else None
    carried = _carried(said, time, color) if said.primvars else ()
    if normals is _MORE or carried is None:
        return None
    holes = integers(said.value("holeIndices", time)) if "holeIndices" in names else None
    return Told(
        np.asarray(points),
        sizes.counts,
        np.asarray(indices),
        sizes.faces,
        _NO_HOLES if holes is None else holes,
        scheme,
        "orientation" in names and said.value("orientation", _ALWAYS) == UsdGeom.Tokens.leftHanded,
        normals,
        carried,
    )


def _normals(said: Said, time: Usd.TimeCode) -> Lying | None:
    """Those that count, None without any; _MORE where they are no vectors, or the same everywhere."""
    if "primvars:normals" in said.names:
        attribute, fallback = said.properties["primvars:normals"], _CONSTANT
        if attribute.GetTypeName() not in _NORMALS:
            return _MORE
    elif "normals" in said.names:
        attribute, fallback = said.properties["normals"], _VERTEX
    else:
        return None
    value, interpolation = attribute.Get(time), attribute.GetMetadata("interpolation") or fallback
    if not isinstance(value, Vt.Vec3fArray) or not value or interpolation == _CONSTANT:
        return _MORE
    return Lying("normals", "", np.asarray(value), interpolation)


def _carried(said: Said, time: Usd.TimeCode, color: str) -> tuple[Lying, ...] | None:
    """Colour, opacity and texture coordinates, its own or inherited; None where there is more to them."""
    handed_down = _inherited(said.inherited, time, color)
    if handed_down is None:
        return None
    found = {**handed_down}
    for name in said.lying:
        short = name[len(_PRIMVARS) :]
        lying = _lying(short, said.properties[name], said.properties.get(name + _INDICES), time, color)
        if lying is _MORE or (lying is None and short in found):
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
        inherited.read[key] = None if any(each is _MORE for each in found.values()) else found
    known: _Found | None = inherited.read[key]
    return known


def _lying(
    name: str, attribute: Usd.Property, indices: Usd.Property | None, time: Usd.TimeCode, color: str
) -> Lying | None:
    """A primvar as that for which it counts; None of one that is not read, _MORE where there is more to it."""
    if not isinstance(attribute, Usd.Attribute):
        return _MORE
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
        return _MORE
    colors = in_rec709(attribute, value) if is_color(attribute) else value
    return _laid("display_color", name, attribute, floats(colors, 3), indices, time)


def _laid(
    field: Field,
    name: str,
    attribute: Usd.Attribute,
    values: NDArray[np.float32] | None,
    indices: Usd.Property | None,
    time: Usd.TimeCode,
) -> Lying:
    chosen = None if indices is None else indices.Get(time)
    if values is None or not len(values) or not (indices is None or isinstance(chosen, Vt.IntArray)):
        return _MORE
    interpolation = attribute.GetMetadata("interpolation") or _CONSTANT
    return Lying(field, name, values, interpolation, None if chosen is None else np.asarray(chosen))
