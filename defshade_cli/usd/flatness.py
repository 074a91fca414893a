"""How far a subdivision surface is from its cage, estimated without refining it.

The normals at the ends of an edge of length e turn by an angle θ: over it the surface rises like an arc, by e θ / 8.
Refinement halves e and θ alike, so that every level leaves a quarter of the distance.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.normals import smooth
from defshade_cli.usd.polygons import Polygons

_QUANTILE = 0.98
"""Of the edges that are taken for the surface; the few sharpest would refine all others with them."""


def _once(measured: Callable[[Polygons], float]) -> Callable[[Polygons], float]:
    """Measured once for polygons that surfaces share."""
    known: WeakKeyDictionary[Polygons, float] = WeakKeyDictionary()

    @wraps(measured)
    def measure(polygons: Polygons) -> float:
        found = known.get(polygons)
        if found is None:
            found = known[polygons] = measured(polygons)
        return found

    return measure


@_once
def mean_edge(polygons: Polygons) -> float:
    """Root of the mean square of the edges' lengths in object units, 0 without any; an edge counts once a face."""
    return float(np.sqrt(np.square(_edges(polygons)).sum() / max(len(polygons.indices), 1)))


@_once
def rise(polygons: Polygons) -> float:
    """Of the surface over its cage, in object units."""
    rises = _warps(polygons) if polygons.scheme == "bilinear" else _arcs(polygons)
    return float(np.quantile(rises, _QUANTILE)) if len(rises) else 0.0


def _arcs(polygons: Polygons) -> NDArray[np.float64]:
    """(C,) over the edge that leaves each corner."""
    normals = smooth(polygons).values[polygons.indices].astype(np.float64)
    cosine = np.einsum("ci,ci->c", normals, normals[polygons.following])
    return np.linalg.norm(_edges(polygons), axis=1) * np.arccos(np.clip(cosine, -1.0, 1.0)) / 8.0


def _warps(polygons: Polygons) -> NDArray[np.float64]:
    """Of quads a, b, c, d, halfway between their diagonals; larger faces are split at their middle and stay flat."""
    quads = [polygons.points[polygons.indices[c]].astype(np.float64) for _, c in polygons.by_size() if c.shape[1] == 4]
    a, b, c, d = np.moveaxis(np.concatenate([np.empty((0, 4, 3)), *quads]), 1, 0)
    return np.linalg.norm(a - b + c - d, axis=1) / 4.0


def _edges(polygons: Polygons) -> NDArray[np.float64]:
    """(C, 3) from each corner to the next."""
    points = polygons.points[polygons.indices].astype(np.float64)
    return points[polygons.following] - points
