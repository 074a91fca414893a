"""Polygons on the limit of their subdivision surface."""

from __future__ import annotations

from dataclasses import replace
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.polygons.control import Control
from defshade_cli.usd.polygons.normals import smooth
from defshade_cli.usd.polygons.polygons import Interpolation, Polygons, Primvar
from defshade_cli.usd.polygons.welding import weld
from defshade_cli.usd.subdivision import Stencils, limit, refine, refine_face_varying

_MOST_KEPT = 64
"""Sets of face-varying stencils of one topology that are remembered."""

FaceVarying = tuple[Stencils, NDArray[np.int32]]


class Weights:
    """Of one control mesh at one level, whatever points and primvars it has; meshes that are wired alike share them."""

    def __init__(self, control: Control, level: int) -> None:
        self.refinement = refine(control.topology, level)
        self.limit = limit(self.refinement)
        self._control, self._level = control, level
        self._face_varying: dict[bytes, FaceVarying] = {}

    def carried(self, values: NDArray[np.floating], interpolation: Interpolation) -> NDArray[np.float64]:
        """A primvar (N, ...) of points or faces, on the surface."""
        match interpolation:
            case "uniform":
                return values[self.refinement.parents].astype(np.float64)
            case "varying":
                return (self.refinement.varying @ values)[self.limit.vertices]
            case _:
                return self.limit.at(self.refinement.vertex @ values)

    def carried_corners(self, values: NDArray[np.floating], number: NDArray[np.int32]) -> NDArray[np.float64]:
        """A primvar of corners. values: (N, ...) distinct ones.  number: (C,) which of them each corner has."""
        stencils, at = self._face_varying_of(number, len(values))
        return (stencils @ values)[at]

    def _face_varying_of(self, number: NDArray[np.int32], count: int) -> FaceVarying:
        key = number.tobytes()
        if key not in self._face_varying:
            if len(self._face_varying) == _MOST_KEPT:
                self._face_varying.clear()
            self._face_varying[key] = refine_face_varying(
                self._control.topology, number, count, self._control.face_varying, self._level, at_limit=True
            )
        return self._face_varying[key]


_KNOWN: WeakValueDictionary[tuple[bytes, str, int], Weights] = WeakValueDictionary()


def weights_of(control: Control, level: int) -> Weights:
    """The same for meshes that are wired alike."""
    key = control.topology.digest(), control.face_varying, level
    known = _KNOWN.get(key)
    if known is None:
        known = _KNOWN[key] = Weights(control, level)
    return known


class Refiner:
    """A control mesh at one level: its weights, and the primvars that it had last.

    Refined points are moved to the limit surface, so that every level lies on the same surface and has its exact
    normals. Points are one a sector, see subdivision.Limit: a crease splits them, and normals stay on the points.
    """

    def __init__(self, control: Control, level: int) -> None:
        self.control, self.level = control, level
        self._weights = weights_of(control, level)
        self._refinement, self._limit = self._weights.refinement, self._weights.limit
        self._last: dict[Primvar, Primvar] = {}

    def fits(self, control: Control, level: int) -> bool:
        """Whether it serves this control cage at this level."""
        return level == self.level and (control is self.control or control.equals(self.control))

    def refine(self, cage: Polygons) -> Polygons:
        """The surface of a cage with this topology. Holes are left out, and what no boundary rule bounds."""
        refined = self._refinement.vertex @ only_finite(cage.points)
        surface = replace(
            cage,
            points=self._limit.at(refined).astype(np.float32),
            counts=self._refinement.face_counts,
            indices=self._limit.sectors,
            faces=cage.faces[self._refinement.parents],
            holes=np.empty(0, np.int32),
        )
        self._last = {p: self._last.get(p) or self._carried(p, cage) for p in surface.primvars}
        surface = surface.with_primvars(self._last.__getitem__)
        return replace(surface, normals=self._normals(surface, refined)).select(~self._refinement.holes)

    def _normals(self, surface: Polygons, refined: NDArray[np.float64]) -> Primvar:
        """Exact, and from the faces where the surface has collapsed."""
        normals = self._limit.normals(refined) * (-1.0 if surface.left_handed else 1.0)
        collapsed = ~normals.any(axis=1)
        if collapsed.any():
            normals[collapsed] = smooth(surface).values[collapsed]
        return Primvar(normals.astype(np.float32), "vertex")

    def _carried(self, primvar: Primvar, cage: Polygons) -> Primvar:
        """A primvar of the cage on the surface."""
        match primvar.interpolation:
            case "constant":
                return primvar
            case "faceVarying":  # corners with one value at one point are one: it is smooth across their edge
                number, chosen = weld(cage.indices, primvar.values)
                values = self._weights.carried_corners(primvar.values[chosen], number)
            case interpolation:
                values = self._weights.carried(primvar.values, interpolation)
        return replace(primvar, values=values.astype(np.float32))


def only_finite(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """(P, 3), zero where one is not finite: those that no face uses may be anything."""
    return np.where(np.isfinite(points), points, np.float32(0.0))
