"""Fewer triangles between points that a mesh has, for what sees it coarsely: the only meshoptimizer.

Edges collapse where the planes of the triangles around them allow it (Garland & Heckbert 1997, "Surface Simplification
Using Quadric Error Metrics"). Planes count by their area, and what is thin has hardly any at its rim: sheets would be
eaten from there, and wires vanish. So triangles that face along other axes are no neighbours, and the points between
them lie along a seam, which is kept as a line.
"""

from __future__ import annotations

from functools import lru_cache
from importlib.util import find_spec
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.closed import first_of_equal, is_closed
from defshade_cli.scene.geometry import Mesh
from defshade_cli.spaces import cross

INSTALL = "pip install 'defshade[meshoptimizer]'"

_LEAST_SAVED = 0.25
"""Of the triangles; or it is not worth it."""

_AREA_KEPT = 1.0 / 32.0
"""By which a mesh's area may change: shadows, over all directions, change by as much. Bumps and wires would by more."""

_AXES = 6

Triangles = NDArray[np.uint32]

_KNOWN: WeakKeyDictionary[Mesh, dict[int, Triangles | None]] = WeakKeyDictionary()


def can_be_coarse() -> bool:
    """Is the package there?"""
    return find_spec("meshoptimizer") is not None


def coarse_triangles(mesh: Mesh, level: int) -> Triangles | None:
    """(T, 3) into the mesh's points, about 2^level off its surface in object space; None where all shall be drawn.

    What is closed stays so.
    """
    known = _KNOWN.setdefault(mesh, {})
    if level not in known:
        known[level] = _coarse(mesh, 2.0**level)
    return known[level]


def _coarse(mesh: Mesh, deviation: float) -> Triangles | None:
    if not np.isfinite(mesh.points).all():
        return None
    seamed = _seamed(mesh)
    coarse = seamed.simplified(deviation)
    if len(coarse) > (1.0 - _LEAST_SAVED) * len(mesh.triangles):
        return None
    area = _lengths(_normals(mesh.points, coarse)).sum(dtype=np.float64)
    if not abs(area - seamed.area) <= _AREA_KEPT * seamed.area:
        return None
    return None if mesh.is_closed and not is_closed(mesh.points, coarse) else coarse


@dataclass(frozen=True, slots=True, eq=False)
class _Seamed:
    """A mesh whose triangles share points where they are neighbours that face along the same axis.

    points: (N, 3).  of: (N,) the mesh's points that they are.  indices: (3 T,) uint32.  area: twice that of all.
    """

    points: NDArray[np.float32]
    of: NDArray[np.intp]
    indices: NDArray[np.uint32]
    area: float

    def simplified(self, deviation: float) -> Triangles:
        """(T', 3) into the mesh's points."""
        from meshoptimizer import SIMPLIFY_ERROR_ABSOLUTE, simplify

        left = np.empty_like(self.indices)
        limits = {"target_index_count": 0, "target_error": deviation}
        count = simplify(left, self.indices, self.points, options=SIMPLIFY_ERROR_ABSOLUTE, **limits)
        return np.asarray(self.of[left[:count].reshape(-1, 3)], np.uint32)


@lru_cache(maxsize=1)
def _seamed(mesh: Mesh) -> _Seamed:
    first, place = first_of_equal(mesh.points)
    normals = _normals(mesh.points, mesh.triangles)
    axis = np.abs(normals).argmax(axis=1)
    facing = 2 * axis + (normals[np.arange(len(axis)), axis] < 0.0)
    apart = place[mesh.triangles] * _AXES + facing[:, None]
    used = np.zeros(len(first) * _AXES, bool)
    used[apart] = True
    of = first[np.flatnonzero(used) // _AXES]
    indices = (np.cumsum(used, dtype=np.uint32) - np.uint32(1))[apart.ravel()]
    return _Seamed(mesh.points[of], of, indices, _lengths(normals).sum(dtype=np.float64))


def _normals(points: NDArray[np.float32], triangles: Triangles) -> NDArray[np.float32]:
    """(T, 3), twice as long as the triangles' areas."""
    a, b, c = (points[corner] for corner in triangles.T)
    return np.asarray(cross(b - a, c - a))


def _lengths(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(np.sqrt(np.einsum("nk,nk->n", vectors, vectors)))
