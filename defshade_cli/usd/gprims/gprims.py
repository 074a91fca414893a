"""Cube, Plane and the solids of revolution as Polygons with the exact normals of what they stand for.

Points lie on the true surface, so a tessellated solid is inscribed in it. A gprim's outside is known, so its
authored orientation is of no account.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.gprims.cages import capsule_cage, cone_cage, frustum_cage, sphere_cage
from defshade_cli.usd.gprims.revolution import SEGMENTS, Strip, arc, disk, revolve, side
from defshade_cli.usd.polygons.lying import sound_carried
from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.polygons.primvars import Elements, count_elements, read_carried
from defshade_cli.usd.said import Said
from defshade_cli.usd.values import floats

_SPINE = {"X": 1, "Y": 2, "Z": 0}
"""Cyclic steps that take the spine from z to the axis; a cyclic permutation keeps the winding."""

_MOST_KEPT = 256
"""Solids that are remembered."""

_LARGEST_SIZE = 1e37
"""Beyond it points would leave the range of float32."""


def cube(size: float) -> Polygons:
    """Points and faces in Hydra's order, so that colours a face or a point land where others put them."""
    top = [[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]
    bottom = [[-1, -1, -1], [-1, 1, -1], [1, 1, -1], [1, -1, -1]]
    sides = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 6, 5, 1], [4, 7, 3, 2], [0, 3, 7, 6], [4, 2, 1, 5]]
    return _quads(np.array(top + bottom) * (0.5 * size), np.array(sides))


def plane(width: float, length: float) -> Polygons:
    """Across the spine, facing along it."""
    corners = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]) * (0.5 * width, 0.5 * length, 0.0)
    return _quads(corners, np.array([[0, 1, 2, 3]]))


def sphere(radius: float, segments: int = SEGMENTS) -> Polygons:
    """A UsdGeomSphere as polygons. radius: in scene units."""
    return revolve([arc(radius, 0.0, -math.pi / 2, math.pi / 2, segments)], segments)


def frustum(height: float, top: float, bottom: float, segments: int = SEGMENTS) -> Polygons:
    """A cylinder of two radii, with its caps."""
    half = 0.5 * height
    return revolve([disk(bottom, -half, -1), side(bottom, top, height), disk(top, half, 1)], segments)


def cone(height: float, radius: float, segments: int = SEGMENTS) -> Polygons:
    """A UsdGeomCone along z as polygons, its tip up. height, radius: in scene units."""
    return frustum(height, 0.0, radius, segments)


def capsule(height: float, top: float, bottom: float, segments: int = SEGMENTS) -> Polygons:
    """A frustum's mantle, continued smoothly by a sphere at each end.

    The radii are those of the rings where mantle and spheres meet, `height` apart, as in the extent that
    UsdGeomCapsule_1 computes: with s = (bottom − top) / height, a sphere that meets the mantle at radius r has the
    radius r √(1 + s²), and its centre is s r below the ring.
    """
    slope = (bottom - top) / height if height else 0.0
    meet, stretch = math.atan(slope), math.hypot(1.0, slope)
    lower = arc(bottom * stretch, -0.5 * height - slope * bottom, -math.pi / 2, meet, segments)
    upper = arc(top * stretch, 0.5 * height - slope * top, meet, math.pi / 2, segments)
    profile = Strip(
        np.concatenate([lower.points, upper.points]),
        np.concatenate([lower.normals, upper.normals]),
    )
    return revolve([profile], segments)


_GPRIMS: dict[str, tuple[Callable[..., Polygons], tuple[str, ...]]] = {
    "Cube": (cube, ("size",)),
    "Plane": (plane, ("width", "length")),
    "Sphere": (sphere, ("radius",)),
    "Cylinder": (frustum, ("height", "radius", "radius")),
    "Cylinder_1": (frustum, ("height", "radiusTop", "radiusBottom")),
    "Cone": (cone, ("height", "radius")),
    "Capsule": (capsule, ("height", "radius", "radius")),
    "Capsule_1": (capsule, ("height", "radiusTop", "radiusBottom")),
}
"""Of each type what builds it, and the attributes that go into that."""

_CAGES: dict[Callable[..., Polygons], Callable[..., Polygons]] = {
    sphere: sphere_cage,
    frustum: frustum_cage,
    cone: cone_cage,
    capsule: capsule_cage,
}


@dataclass(frozen=True, slots=True)
class Solid:
    """What a solid of revolution is made from. sizes: what `build` takes, as _built has them.  segments: around."""

    build: Callable[..., Polygons]
    axis: str
    sizes: tuple[float | None, ...]
    segments: int = SEGMENTS

    def polygons(self, halvings: int = 0) -> Polygons:
        """With half as many segments again and again."""
        return _built(self.build, self.axis, self.sizes, self.segments >> halvings)


def size_attributes(prim: Usd.Prim) -> tuple[str, ...]:
    """What is read of a gprim and may vary over time, besides primvars; nothing for other types."""
    _, names = _GPRIMS.get(prim.GetTypeName(), (None, ()))
    return names


def read_solid(
    prim: Usd.Prim, said: Said, time: Usd.TimeCode, issues: list[str], color: str, *, as_cage: bool
) -> tuple[Polygons, Solid | None] | None:
    """The gprim tessellated, and what it is made from if it is round; None for any other type.

    as_cage: a curved solid is the cage that Hydra subdivides. No faces where a size is no size.
    """
    build, names = _GPRIMS.get(said.type_name, (None, ()))
    if build is None:
        return None
    build = _CAGES.get(build, build) if as_cage else build
    axis = _axis(prim, issues) if "axis" in said.names else "Z"
    if build is plane and axis != "Z":
        names = names[::-1]  # length comes first in cyclic order, by the schema's table of axes
    sizes = tuple([_size(prim, name, time, issues) for name in names])
    solid = Solid(build, axis, sizes) if build in _CAGES else None
    polygons = solid.polygons() if solid else _built(build, axis, sizes)
    if not said.primvars:
        return polygons, solid
    elements = _elements(polygons)
    carried = sound_carried(said, time, color, elements) or read_carried(prim, time, elements, issues, color)
    return carried.laid_on(polygons), solid


@lru_cache(maxsize=_MOST_KEPT)
def _built(build: Callable[..., Polygons], axis: str, sizes: tuple[float | None, ...], *segments: int) -> Polygons:
    """The same object for the same solid: a stage may hold thousands. segments: around a round one."""
    solid = _quads(np.empty((0, 3)), np.empty((0, 4), int)) if None in sizes else build(*sizes, *segments)
    return _along(solid, _SPINE[axis])


def _elements(polygons: Polygons) -> Elements:
    """A curved solid is tessellated as we like, so that only a constant has a meaning on it."""
    if polygons.normals is not None or polygons.scheme != "none":
        return {"constant": 1}
    return count_elements(len(polygons.counts), len(polygons.points), len(polygons.indices))


def _axis(prim: Usd.Prim, issues: list[str]) -> str:
    attribute = prim.GetAttribute("axis")
    axis = attribute.Get() if attribute else "Z"
    if axis in _SPINE:
        return axis
    issues.append(f"axis {axis!r} is none of X, Y, Z; Z is taken")
    return "Z"


def _size(prim: Usd.Prim, name: str, time: Usd.TimeCode, issues: list[str]) -> float | None:
    """A length; a negative one stands for its absolute value."""
    value = floats(prim.GetAttribute(name).Get(time), 1)
    if value is None or len(value) != 1 or not abs(value[0]) < _LARGEST_SIZE:
        issues.append(f"it is left out: {name} is no size")
        return None
    if value[0] < 0.0:
        issues.append(f"{name} is negative; its absolute value is taken")
    return abs(float(value[0]))


def _along(polygons: Polygons, steps: int) -> Polygons:
    """The solid with its spine along another axis."""
    normals = polygons.normals
    if normals is not None:
        normals = replace(normals, values=np.roll(normals.values, steps, axis=1))
    return replace(polygons, points=np.roll(polygons.points, steps, axis=1), normals=normals)


def _quads(corners: NDArray[np.float64], faces: NDArray[np.intp]) -> Polygons:
    """Faces (F, 4) over corners (P, 3), flat."""
    return Polygons(
        points=corners.astype(np.float32),
        counts=np.full(len(faces), 4),
        indices=faces.ravel(),
        faces=np.arange(len(faces), dtype=np.int32),
    )
