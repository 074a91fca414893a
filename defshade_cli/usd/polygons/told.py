"""What a small mesh says, asked with few questions and not looked into: that is done for many at once, see checked.py.

Only meshes whose attributes have the types that are usual are asked so, and only where nothing needs to be said of
them but what is so common that it pays. All others are for usd/polygons/mesh.py, which knows what is wrong with them.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom, Vt

from defshade_cli.usd.color_space import in_rec709
from defshade_cli.usd.polygons.end_to_end import LARGEST
from defshade_cli.usd.polygons.mesh import sizes_of
from defshade_cli.usd.polygons.polygons import SCHEMES, Interpolation, Primvar, Scheme
from defshade_cli.usd.polygons.primvars import find_primvars
from defshade_cli.usd.said import Said

_PRIMVARS, _INDICES = "primvars:", ":indices"
_RARE = frozenset({"velocities", "holeIndices", "primvars:normals:indices"})
_TYPES = Sdf.ValueTypeNames
_UVS = frozenset({_TYPES.TexCoord2fArray, _TYPES.Float2Array})
_NORMALS = frozenset({_TYPES.Normal3fArray, _TYPES.Float3Array, _TYPES.Vector3fArray})
_COLORS = frozenset({_TYPES.Color3fArray, _TYPES.Color4fArray})
_COMMON = (
    _UVS
    | _COLORS
    | frozenset(
        {_TYPES.IntArray, _TYPES.Float3Array, _TYPES.FloatArray, _TYPES.Normal3fArray}
        | {_TYPES.Float4Array, _TYPES.StringArray, _TYPES.TokenArray, _TYPES.String, _TYPES.Token}
        | {_TYPES.Float, _TYPES.Int, _TYPES.Bool, _TYPES.Matrix4d, _TYPES.Vector3fArray, _TYPES.Point3fArray}
    )
)
"""Of primvars; all but the first two are no texture coordinates."""


_DISPLAY_OPACITY = "primvars:displayOpacity"
_NO_INDICES = Vt.IntArray()


class Lying(NamedTuple):
    """Values (N, ...) float32 on a mesh; (D, ...) distinct ones where `indices` (N,) tell which.

    field: of Polygons.  name: of texture coordinates.
    """

    field: Literal["normals", "display_color", "display_opacity", "uvs"]
    name: str
    values: NDArray[np.float32]
    interpolation: Interpolation
    indices: NDArray[np.int32] | None = None

    @property
    def primvar(self) -> Primvar:
        """Its indices followed, which are in range."""
        return Primvar(self.values if self.indices is None else self.values[self.indices], self.interpolation)


class Told(NamedTuple):
    """Of a mesh what the fields of Polygons of these names hold, unless it is not sound. None of it is empty."""

    points: NDArray[np.float32]
    counts: NDArray[np.integer]
    indices: NDArray[np.int32]
    faces: NDArray[np.int32]
    scheme: Scheme
    left_handed: bool
    normals: Lying | None
    carried: tuple[Lying, ...]


_MORE = Lying("normals", "", np.empty((0, 3), np.float32), "constant")
"""Stands for what needs to be looked into."""


def told_of(prim: Usd.Prim, said: Said, time: Usd.TimeCode, color: str) -> Told | None:
    """None where there is more to it. color: as read_surface has it."""
    names = said.names
    if not _RARE.isdisjoint(names):
        return None
    indices = prim.GetAttribute("faceVertexIndices").Get(time)
    if not isinstance(indices, Vt.IntArray) or not 0 < len(indices) <= LARGEST:
        return None
    counts, points = prim.GetAttribute("faceVertexCounts").Get(time), prim.GetAttribute("points").Get(time)
    if not (isinstance(counts, Vt.IntArray) and isinstance(points, Vt.Vec3fArray) and counts and points):
        return None
    scheme = prim.GetAttribute("subdivisionScheme").Get() if "subdivisionScheme" in names else "catmullClark"
    sizes = sizes_of(np.asarray(counts))
    if scheme not in SCHEMES or sizes.corners != len(indices):
        return None
    normals = _normals(prim, said, time) if scheme == "none" else None
    carried = _carried(prim, said, time, color) if said.primvars else ()
    if normals is _MORE or carried is None:
        return None
    left_handed = "orientation" in names and prim.GetAttribute("orientation").Get() == UsdGeom.Tokens.leftHanded
    return Told(
        np.asarray(points), sizes.counts, np.asarray(indices), sizes.faces, scheme, left_handed, normals, carried
    )


def _normals(prim: Usd.Prim, said: Said, time: Usd.TimeCode) -> Lying | None:
    """Those that count, None without any; _MORE where they are no vectors, or the same everywhere."""
    if "primvars:normals" in said.names:
        attribute, fallback = prim.GetAttribute("primvars:normals"), UsdGeom.Tokens.constant
        if attribute.GetTypeName() not in _NORMALS:
            return _MORE
    elif "normals" in said.names:
        attribute, fallback = prim.GetAttribute("normals"), UsdGeom.Tokens.vertex
    else:
        return None
    value, interpolation = attribute.Get(time), attribute.GetMetadata("interpolation") or fallback
    if not isinstance(value, Vt.Vec3fArray) or not value or interpolation == UsdGeom.Tokens.constant:
        return _MORE
    return Lying("normals", "", np.asarray(value), interpolation)


def _carried(prim: Usd.Prim, said: Said, time: Usd.TimeCode, color: str) -> tuple[Lying, ...] | None:
    """Colour, opacity and texture coordinates, its own or inherited; None where there is more to them."""
    found = []
    for name, attribute in _lying(prim, said):
        value = attribute.Get(time) if attribute else None
        is_display = name in (_PRIMVARS + color, _DISPLAY_OPACITY)
        type_name = None if isinstance(value, Vt.Vec2fArray) else attribute and attribute.GetTypeName()
        if type_name is None and is_display:
            return None
        if type_name is not None and type_name not in _COMMON:
            return None
        field, expected = _read_as(name[len(_PRIMVARS) :], type_name, color)
        if not expected:
            continue
        indices = _indices(attribute, name, prim, said, time)
        if not isinstance(value, expected) or not value or not isinstance(indices, Vt.IntArray):
            return None
        colors = in_rec709(attribute, value) if type_name in _COLORS else value
        interpolation = UsdGeom.Primvar(attribute).GetInterpolation()
        chosen = None if indices is _NO_INDICES else np.asarray(indices)
        found.append(Lying(field, name[len(_PRIMVARS) :], np.asarray(colors), interpolation, chosen))
    return tuple(found)


def _lying(prim: Usd.Prim, said: Said) -> Iterable[tuple[str, Usd.Attribute]]:
    """Primvars by the names of their attributes, in the order of read_carried."""
    if not said.inherits:
        return [(name, prim.GetAttribute(name)) for name in said.lying]
    found = ((str(primvar.GetName()), primvar.GetAttr()) for primvar in find_primvars(prim).values())
    return [(name, attribute) for name, attribute in found if name != "primvars:normals"]


def _indices(attribute: Usd.Attribute, name: str, prim: Usd.Prim, said: Said, time: Usd.TimeCode) -> Any:
    if not said.inherits:
        return prim.GetAttribute(name + _INDICES).Get(time) if name + _INDICES in said.names else _NO_INDICES
    primvar = UsdGeom.Primvar(attribute)
    return primvar.GetIndices(time) if primvar.IsIndexed() else _NO_INDICES


def _read_as(name: str, type_name: Sdf.ValueTypeName | None, color: str) -> tuple[Any, type | None]:
    """The field that a primvar fills, and what its values should be; None of one that is not read.

    type_name: None of pairs of floats, which are texture coordinates whatever they are called.
    """
    if type_name is None or type_name in _UVS:
        return "uvs", Vt.Vec2fArray
    if name == color:
        return "display_color", Vt.Vec3fArray
    return "display_opacity", Vt.FloatArray if name == "displayOpacity" else None
