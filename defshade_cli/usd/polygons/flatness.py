"""How far subdivision surfaces are from their cages, estimated without refining them.

The normals at the ends of an edge of length e turn by an angle θ: over it the surface rises like an arc, by e θ / 8.
Refinement halves e and θ alike, so that every level leaves a quarter of the distance.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from functools import wraps
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.polygons.end_to_end import Row, blocks, lay_bare
from defshade_cli.usd.polygons.normals import smooth
from defshade_cli.usd.polygons.polygons import Polygons

_QUANTILE = 0.98
"""Of the edges that are taken for the surface; the few sharpest would refine all others with them."""

Measure = Callable[[Row], NDArray[np.float64]]
"""(M,) of the meshes of a row."""


def _each_once(measured: Measure) -> Callable[[Sequence[Polygons]], list[float]]:
    """Measured once for polygons that surfaces share, and of many together."""
    known: WeakKeyDictionary[Polygons, float] = WeakKeyDictionary()

    @wraps(measured)
    def measure(polygons: Sequence[Polygons]) -> list[float]:
        alike: dict[tuple[str, bool], list[Polygons]] = defaultdict(list)
        for each in dict.fromkeys(polygons):
            if each not in known:
                alike[each.scheme, each.left_handed].append(each)
        for group in alike.values():
            for block in blocks(group, [len(mesh.indices) for mesh in group]):
                known.update(zip(block, measured(lay_bare(block)).tolist(), strict=True))
        return [known[each] for each in polygons]

    return measure


@_each_once
def mean_edges(row: Row) -> NDArray[np.float64]:
    """(M,) root of the mean square of the edges' lengths in object units; an edge counts once a face."""
    squares = np.add.reduceat(np.square(_edges(row.polygons)).sum(axis=1), row.corners[:-1])
    return np.sqrt(squares / np.diff(row.corners))


@_each_once
def rises(row: Row) -> NDArray[np.float64]:
    """(M,) of the surfaces over their cages, in object units."""
    if row.polygons.scheme == "bilinear":
        return _quantiles(*_warps(row))
    return _quantiles(_arcs(row.polygons), np.diff(row.corners))


def _quantiles(values: NDArray[np.float64], sizes: NDArray[np.intp]) -> NDArray[np.float64]:
    """(M,) the _QUANTILE of each of M runs of so many values; 0 of an empty one. Between two values it is linear."""
    ends = np.cumsum(sizes)
    ordered = np.append(values[np.lexsort([values, np.repeat(np.arange(len(sizes)), sizes)])], 0.0)
    place = np.maximum(sizes - 1, 0) * _QUANTILE
    below = place.astype(np.intp)
    low = ordered[ends - sizes + below]
    high = ordered[np.minimum(ends - sizes + below + 1, np.maximum(ends - 1, 0))]
    between = place - below
    found = np.where(between < 0.5, low + (high - low) * between, high - (high - low) * (1.0 - between))
    return np.where(sizes > 0, found, 0.0)


def _arcs(polygons: Polygons) -> NDArray[np.float64]:
    """(C,) over the edge that leaves each corner."""
    normals = smooth(polygons).values[polygons.indices].astype(np.float64)
    cosine = np.einsum("ci,ci->c", normals, normals[polygons.following])
    return np.linalg.norm(_edges(polygons), axis=1) * np.arccos(np.clip(cosine, -1.0, 1.0)) / 8.0


def _warps(row: Row) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Of quads a, b, c, d, halfway between their diagonals; larger faces are split at their middle and stay flat.

    Of all meshes (Q,), and how many quads each has (M,).
    """
    polygons, are_quads = row.polygons, row.polygons.counts == 4
    quads = polygons.indices[are_quads[polygons.face_of_corner]].reshape(-1, 4)
    a, b, c, d = np.moveaxis(polygons.points[quads].astype(np.float64), 1, 0)
    count = np.diff(np.append(0, np.cumsum(are_quads))[row.faces])
    return np.linalg.norm(a - b + c - d, axis=1) / 4.0, count


def _edges(polygons: Polygons) -> NDArray[np.float64]:
    """(C, 3) from each corner to the next."""
    points = polygons.points[polygons.indices].astype(np.float64)
    return points[polygons.following] - points
