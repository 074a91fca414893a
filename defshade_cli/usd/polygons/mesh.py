"""UsdGeom.Mesh → Polygons. What contradicts itself is dropped, and said."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom

from defshade_cli.usd.polygons.normals import mend_normals
from defshade_cli.usd.polygons.polygons import SCHEMES, Polygons, Primvar, Scheme
from defshade_cli.usd.polygons.positions import read_positions, still_positions
from defshade_cli.usd.polygons.primvars import (
    DISPLAY_COLOR,
    NOTHING_CARRIED,
    Authored,
    Elements,
    authored,
    count_elements,
    fit,
    read_carried,
)
from defshade_cli.usd.said import Said
from defshade_cli.usd.values import are_finite, integers

MESH_ATTRIBUTES = ("points", "faceVertexCounts", "faceVertexIndices", "holeIndices", "normals")
"""What is read of a Mesh that may vary over time, besides primvars."""

_POINTS = Sdf.ValueTypeNames.Point3fArray.type
_NONE = np.empty(0, np.int32)
_FEW_FACES = 64


def read_mesh(
    prim: Usd.Prim, said: Said, time: Usd.TimeCode, issues: list[str], color: str = DISPLAY_COLOR
) -> Polygons:
    """The mesh as authored, before refinement: faces that cannot be drawn are left out, holes stay.

    Attributes are asked by name: a schema's accessors take half as long again.
    """
    names = said.names
    points = points_of(prim, said, time, issues)
    counts, indices = _topology(prim, time, issues) if len(points) else (_NONE, _NONE)
    sizes = sizes_of(counts)
    is_whole = sizes.corners == len(indices) and _are_drawn(points, indices)
    if not is_whole:
        counts, indices = _complete(counts, indices, issues)
        sizes = sizes_of(counts)
    scheme = _scheme(prim, issues) if "subdivisionScheme" in names else "catmullClark"
    elements = count_elements(len(counts), len(points), len(indices))
    carried = read_carried(prim, time, elements, issues, color) if said.primvars else NOTHING_CARRIED
    polygons = Polygons(
        points=points,
        counts=sizes.counts,
        indices=indices,
        faces=sizes.faces,
        holes=_holes(prim, time, len(counts), issues) if "holeIndices" in names else _NONE,
        scheme=scheme,
        left_handed="orientation" in names and prim.GetAttribute("orientation").Get() == UsdGeom.Tokens.leftHanded,
        normals=normals_of(prim, said, time, elements, issues) if scheme == "none" else None,
        **carried._asdict(),
    )
    return mend_normals(polygons if is_whole else without_broken_faces(polygons, issues), issues)


def points_of(prim: Usd.Prim, said: Said, time: Usd.TimeCode, issues: list[str]) -> NDArray[np.float32]:
    """(P, 3) of what is based on points; none, and an issue, where it has no sound ones."""
    points = read_positions(prim, time) if "velocities" in said.names else still_positions(prim, time)
    if points is None or not len(points):
        type_name = prim.GetAttribute("points").GetTypeName()
        issues.append("it has no points" if type_name.type == _POINTS else f"its points are {type_name}, not point3f[]")
        return np.empty((0, 3), np.float32)
    return points


def _topology(prim: Usd.Prim, time: Usd.TimeCode, issues: list[str]) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """Corners a face, and their indices, as they are authored."""
    counts = integers(prim.GetAttribute("faceVertexCounts").Get(time))
    indices = integers(prim.GetAttribute("faceVertexIndices").Get(time))
    if counts is None or indices is None or not len(counts) or not len(indices):
        issues.append("it has no faces")
        return _NONE, _NONE
    return counts, indices


class Sizes(NamedTuple):
    """counts, faces: as in Polygons.  corners: of all faces; −1 where one has fewer than three."""

    counts: NDArray[np.integer]
    faces: NDArray[np.int32]
    corners: int


def sizes_of(counts: NDArray[np.integer]) -> Sizes:
    """Of faces with so many corners each (F,). Of few faces the same arrays wherever they are equal.

    Small meshes have so many quads, or so many triangles.
    """
    if len(counts) > _FEW_FACES:
        return _added_up(counts)
    return _of_few(counts.dtype, counts.tobytes())


@lru_cache(maxsize=1 << 12)
def _of_few(number: np.dtype[Any], counts: bytes) -> Sizes:
    return _added_up(np.frombuffer(counts, number))


def _added_up(counts: NDArray[np.integer]) -> Sizes:
    is_whole = len(counts) and np.minimum.reduce(counts) >= 3
    corners = int(np.add.reduce(counts, dtype=np.int64)) if is_whole else -1
    return Sizes(counts, np.arange(len(counts), dtype=np.int32), corners)


def _are_drawn(points: NDArray[Any], indices: NDArray[Any]) -> bool:
    """Are all corners at points that exist, and all points finite?

    By one reduction for both ends of a range: arrays are small, and each question counts.
    """
    unsigned = indices.view(f"u{indices.itemsize}")  # what is negative is large
    return bool(np.maximum.reduce(unsigned) < len(points)) and are_finite(points)


def _complete(
    counts: NDArray[np.integer], indices: NDArray[np.integer], issues: list[str]
) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """Counts that are not negative, and as many indices; faces whose corners are missing are cut off.

    The counts are not believed before they are compared: no memory is taken for what they claim.
    """
    if not len(counts):
        return counts, indices
    counts = np.maximum(counts, 0)
    ends = np.cumsum(counts, dtype=np.int64)
    complete = int(np.searchsorted(ends, len(indices), "right"))
    if complete < len(counts):
        issues.append(f"{len(counts) - complete} faces are left out: faceVertexIndices ends before them")
    elif ends[-1] < len(indices):
        issues.append(f"{len(indices) - ends[-1]} faceVertexIndices are left over after the last face")
    return counts[:complete], indices[: ends[complete - 1] if complete else 0]


def _scheme(prim: Usd.Prim, issues: list[str]) -> Scheme:
    authored_scheme = prim.GetAttribute("subdivisionScheme").Get()
    if authored_scheme in SCHEMES:
        return cast(Scheme, authored_scheme)
    issues.append(f"subdivisionScheme {authored_scheme!r} is unknown; the mesh is drawn as polygons")
    return "none"


def _holes(prim: Usd.Prim, time: Usd.TimeCode, faces: int, issues: list[str]) -> NDArray[np.integer]:
    holes = integers(prim.GetAttribute("holeIndices").Get(time))
    if holes is None:
        return _NONE
    valid = (holes >= 0) & (holes < faces)
    if not valid.all():
        issues.append(f"{np.count_nonzero(~valid)} holeIndices name no face")
    return holes[valid]


def normals_of(prim: Usd.Prim, said: Said, time: Usd.TimeCode, elements: Elements, issues: list[str]) -> Primvar | None:
    """primvars:normals wins over normals, unless it is of no use."""
    normals = None
    if "primvars:normals" in said.names:
        normals = fit(authored(UsdGeom.PrimvarsAPI(prim).GetPrimvar("normals"), time), 3, elements, issues)
    if normals is None and "normals" in said.names:
        based = UsdGeom.PointBased(prim)
        value = Authored("normals", based.GetNormalsAttr().Get(time), based.GetNormalsInterpolation())
        normals = fit(value, 3, elements, issues)
    return normals


def without_broken_faces(polygons: Polygons, issues: list[str]) -> Polygons:
    """The faces of three corners and more, all of them at points that exist and are finite."""
    missing = (polygons.indices < 0) | (polygons.indices >= len(polygons.points))
    adrift = np.zeros_like(missing)
    lost = np.logical_not(np.isfinite(polygons.points).all(axis=1))
    adrift[~missing] = lost[polygons.indices[~missing]]
    small = polygons.counts < 3
    reasons = {
        "they have fewer than 3 corners": small,
        "their indices are out of range": polygons.any_corner(missing) & ~small,
        "their points are not finite": polygons.any_corner(adrift) & ~small,
    }
    for reason, faces in reasons.items():
        if faces.any():
            issues.append(f"{np.count_nonzero(faces)} faces are left out: {reason}")
    return polygons.select(~np.logical_or.reduce(list(reasons.values())))
