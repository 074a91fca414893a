"""Normals that follow from the shape, and authored ones made fit to shade with."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.spaces import cross
from defshade_cli.usd.polygons.end_to_end import LARGEST, Row
from defshade_cli.usd.polygons.polygons import Polygons, Primvar

_NO_SHAPE = (0.0, 0.0, 1.0)
"""The normal of what has no area."""

_OPPOSED = -1e-3
"""Mean cosine between normals and faces below which the two are taken to disagree."""

_CLEAR = 0.5
"""Mean cosine in a face of which there is no doubt."""

_ASKED_FIRST = 256
"""Faces of a large mesh."""

_UNCLEAR = 1e-6
"""Of that cosine: sums may differ by so much with the order in which they are taken."""


def vector_areas(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(B, 3) normals of faces (B, n, 3), as long as twice the area; concave and bent faces too (Newell)."""
    spokes = corners[:, 1:] - corners[:, :1]
    return cross(spokes[:, :-1], spokes[:, 1:]).sum(axis=1)


def with_normals(polygons: Polygons) -> Polygons:
    """Normals where none are: smooth for Catmull–Clark and Loop, else faceted, as the schema of UsdGeomMesh says."""
    if polygons.normals is not None:
        return polygons
    computed = smooth if polygons.scheme in ("catmullClark", "loop") else faceted
    return replace(polygons, normals=computed(polygons))


def mend_normals(polygons: Polygons, issues: list[str]) -> Polygons:
    """Authored normals of unit length, those without a direction computed, and the winding after them.

    Normals say where outside is; where most faces disagree, it is the orientation that was authored wrong.
    """
    if polygons.normals is None:
        return polygons
    normals = _of_unit_length(polygons, polygons.normals, issues)
    if _opposed(polygons, normals):
        issues.append("the normals oppose the winding, which is reversed")
        polygons = replace(polygons, left_handed=not polygons.left_handed)
    return replace(polygons, normals=normals)


def unit_normals(row: Row, normals: Primvar) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Normals of all meshes of a row as mend_normals makes them, and (M,) where nothing else needs to be mended."""
    found = ~_lost(normals.values)
    units = _unit(normals.values if found.all() else np.where(found[:, None], normals.values, np.float32(0.0)))
    along, most = (
        np.add.reduceat(each, row.faces[:-1])
        for each in _agreement(row.polygons, Primvar(units, normals.interpolation))
    )
    agree = (along > (_OPPOSED + _UNCLEAR) * most) | (most == 0.0)
    return units, agree & np.logical_and.reduceat(found, row.starts(normals.interpolation)[:-1])


def faceted(polygons: Polygons) -> Primvar:
    """One unit normal a face."""
    return Primvar(_unit(_outward_areas(polygons)), "uniform")


def smooth(polygons: Polygons) -> Primvar:
    """One unit normal a point: its faces' normals weighted by the angle they fill there.

    Thürmer and Wüthrich, "Computing Vertex Normals from Polygonal Facets", 1998: unlike a weighting by area,
    it does not depend on how a flat part is cut into faces.
    """
    areas = _outward_areas(polygons)
    facets = np.where(areas.any(axis=1, keepdims=True), _unit(areas), 0.0)[polygons.face_of_corner]
    weighted = facets * _corner_angles(polygons)[:, None]
    count = len(polygons.points)
    normals = np.stack([np.bincount(polygons.indices, axis, count) for axis in weighted.T], axis=1)
    cancelled = np.einsum("pi,pi->p", normals, normals) < 1e-12
    if cancelled.any():
        one_facet = np.zeros((count, 3))
        one_facet[polygons.indices] = facets
        normals[cancelled] = one_facet[cancelled]
    return Primvar(_unit(normals), "vertex")


def _outward_areas(polygons: Polygons) -> NDArray[np.float64]:
    """(F, 3) vector areas of the faces, towards the outside."""
    areas = np.empty((len(polygons.counts), 3))
    for faces, corners in polygons.by_size():
        areas[faces] = vector_areas(polygons.points[polygons.indices[corners]].astype(np.float64))
    return -areas if polygons.left_handed else areas


def _corner_angles(polygons: Polygons) -> NDArray[np.float64]:
    """(C,) radians between the two edges at each corner."""
    angles = np.empty(len(polygons.indices))
    for _, corners in polygons.by_size():
        points = polygons.points[polygons.indices[corners]].astype(np.float64)
        ahead = np.roll(points, -1, axis=1) - points
        behind = np.roll(points, 1, axis=1) - points
        across = np.linalg.norm(cross(ahead, behind), axis=-1)
        angles[corners] = np.arctan2(across, np.einsum("bni,bni->bn", ahead, behind))
    return angles


def _of_unit_length(polygons: Polygons, normals: Primvar, issues: list[str]) -> Primvar:
    values = normals.values
    lost = _lost(values)
    if lost.any():
        issues.append(f"{lost.sum()} normals have no direction and follow from the shape")
        values = np.where(lost[:, None], _from_shape(polygons, normals), values)
    return Primvar(_unit(values), normals.interpolation)


def _lost(vectors: NDArray[Any]) -> NDArray[np.bool_]:
    """(N,) those that have no direction."""
    squares = np.einsum("ni,ni->n", vectors, vectors, dtype=np.float64)
    return ~((squares > 0.0) & (squares < np.inf))  # NaN is neither


def _from_shape(polygons: Polygons, like: Primvar) -> NDArray[np.float32]:
    """Computed normals with the interpolation of `like`."""
    match like.interpolation:
        case "constant":
            return _unit(_outward_areas(polygons).sum(axis=0, keepdims=True))
        case "uniform":
            return faceted(polygons).values
        case "faceVarying":
            return polygons.at_corners(faceted(polygons))
        case _:
            return smooth(polygons).values


def _opposed(polygons: Polygons, normals: Primvar) -> bool:
    """Do the normals, on the whole, point away from the outside that the winding gives?

    Of a large mesh some faces are asked first: where none is in doubt, none of the others is asked.
    """
    if len(polygons.indices) > LARGEST:
        along, most = _agreement(polygons, normals, max(len(polygons.counts) // _ASKED_FIRST, 1))
        if (along >= _CLEAR * most).all():
            return False
    along, most = _agreement(polygons, normals)
    return bool(along.sum() < _OPPOSED * most.sum())


def _agreement(polygons: Polygons, normals: Primvar, every: int = 1) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(F,) the normals of each face's corners along its outside, times twice its area; and as much as that can be.

    every: how many faces there are for one that is asked; 0 for the others.
    """
    along, most = np.zeros((2, len(polygons.counts)))
    for block, of_block in polygons.by_size():
        faces, corners = block[::every], of_block[::every]
        areas = _rough_areas(polygons.points[polygons.indices[corners]])
        along[faces] = np.einsum("bi,bni->b", areas, polygons.at_corners(normals, corners), dtype=np.float64)
        most[faces] = corners.shape[1] * np.sqrt(np.einsum("bi,bi->b", areas, areas))
    return -along if polygons.left_handed else along, most


def _rough_areas(corners: NDArray[np.float32]) -> NDArray[np.floating]:
    """As vector_areas, of quads by their diagonals in float32."""
    if corners.shape[1] != 4:
        return vector_areas(corners.astype(np.float64))
    return cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])


def _unit(vectors: NDArray[Any]) -> NDArray[np.float32]:
    """(N, 3) unit vectors; what has no length becomes the normal of no shape."""
    length = np.sqrt(np.einsum("ni,ni->n", vectors, vectors, dtype=np.float64))[:, None]
    units = np.empty(vectors.shape, np.float32)
    units[:] = _NO_SHAPE
    return np.divide(vectors, length, out=units, where=length > 0.0, casting="same_kind")
