"""Trim curves: which part of a NurbsPatch is drawn, and triangles of that part alone.

Loops of rational B-splines bound it in parameter space. As RenderMan's RiTrimCurve has it, which the schema follows,
inside is what an odd number of loops enclose, and what lies to the left of the curves; so a lone clockwise loop is a
hole.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.usd.values import places_in_runs

Array = NDArray[np.float64]

_WIDTHS = {"counts": 1, "orders": 1, "vertexCounts": 1, "knots": 1, "ranges": 2, "points": 3}
TRIM_ATTRIBUTES = tuple(f"trimCurve:{name}" for name in _WIDTHS)

_STEPS = 16
"""Segments along a span of a curve."""
_LONGEST = 0.5
"""Segment along a loop, where the samples of the patch are 1 apart."""
_BESIDE = _LONGEST / np.sqrt(2.0)
"""Samples nearer than this to a loop's points give way: then no circle over a segment holds one, and Delaunay's
triangles have the segment as an edge."""


def read_loops(patch: UsdGeom.NurbsPatch, time: Usd.TimeCode) -> list[Array]:
    """(N, 2) u and v along each loop. Raises ValueError with the reason where the attributes do not fit each other."""
    prim = patch.GetPrim()
    counts, orders, sizes, knots, ranges, points = (_values(prim, name, time) for name in _WIDTHS)
    curves = int(counts.sum())
    if len(orders) != curves or len(sizes) != curves or len(ranges) != curves or (counts < 1).any():
        raise ValueError(f"they are not {curves} curves")
    if (orders < 2).any() or (sizes < orders).any():
        raise ValueError("a curve has fewer points than its order")
    if len(points) != sizes.sum() or len(knots) != (sizes + orders).sum():
        raise ValueError(f"they have not {sizes.sum()} points and {(sizes + orders).sum()} knots")
    ends, knot_ends = _ends(sizes), _ends(sizes + orders)
    traced = [
        _traced(int(order) - 1, knots[knot_ends[i] : knot_ends[i + 1]], points[ends[i] : ends[i + 1]], ranges[i])
        for i, order in enumerate(orders)
    ]
    return [np.concatenate(traced[first:end]) for first, end in pairwise(_ends(counts).tolist())]


def inside(loops: list[Array], us: Array, vs: Array) -> tuple[Array, NDArray[np.int32]]:
    """Of a patch that is sampled at `us` (M,) times `vs` (N,): points (P, 2), u and v, and triangles (T, 3) of them.

    The triangles cover what is inside the loops, and have the loops as edges. Cells that no loop comes near are whole.
    """
    rows, columns = np.arange(len(vs), dtype=float), np.arange(len(us), dtype=float)
    traced = [_no_longer(np.column_stack([_at(us, columns, loop[:, 0]), _at(vs, rows, loop[:, 1])])) for loop in loops]
    edge = np.unique(np.concatenate(traced).clip(0.0, (columns[-1], rows[-1])).round(9), axis=0)
    samples = np.stack(np.meshgrid(columns, rows), axis=-1)
    near = _near(edge, (len(vs) - 1, len(us) - 1))
    triangles = np.concatenate([_whole(near, traced), _along(edge, samples, near, traced)])
    used, drawn = np.unique(triangles, return_inverse=True)
    points = np.concatenate([samples.reshape(-1, 2), edge])[used]
    at = np.column_stack([np.interp(points[:, 0], columns, us), np.interp(points[:, 1], rows, vs)])
    return at, drawn.reshape(triangles.shape).astype(np.int32)


def _near(edge: Array, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Of the cells (N − 1, M − 1) between samples those that hold points of loops (E, 2), and those around them.

    A loop is a cell away from all others, which is why Delaunay's triangles have the sides between the two as edges.
    """
    column, row = np.minimum(edge.astype(int), np.subtract(shape[::-1], 1)).T
    held = np.zeros((shape[0] + 2, shape[1] + 2), bool)
    for down, right in np.ndindex(3, 3):
        held[row + down, column + right] = True
    return held[1:-1, 1:-1]


def _whole(near: NDArray[np.bool_], loops: list[Array]) -> NDArray[np.intp]:
    """(T, 3) samples, numbered row by row: of the cells inside the loops that are not near any, halved.

    Between cells that are near, those of a row are all inside or all outside.
    """
    far = ~near
    first = far & ~np.pad(far, ((0, 0), (1, 0)))[:, :-1]
    row, column = np.nonzero(first)
    inside_run = np.append(_enclosed(np.column_stack([column + 0.5, row + 0.5]), loops), False)
    run = np.cumsum(first).reshape(far.shape) - 1
    row, column = np.nonzero(far & inside_run[run])
    across = near.shape[1] + 1
    corner = row * across + column
    halves = np.array([[0, 1, across + 1], [0, across + 1, across]])
    return (corner[:, None, None] + halves).reshape(-1, 3)


def _along(edge: Array, samples: Array, near: NDArray[np.bool_], loops: list[Array]) -> NDArray[np.intp]:
    """(T, 3) of the samples (N, M, 2), and of `edge` after them: what of the cells `near` is inside the loops."""
    from scipy.spatial import Delaunay, cKDTree  # few stages have patches

    beside = np.pad(near, 1)
    corners = beside[1:, 1:] | beside[:-1, 1:] | beside[1:, :-1] | beside[:-1, :-1]
    on_border = ((samples == 0.0) | (samples == samples[-1, -1])).any(axis=-1)[corners]
    apart = cKDTree(edge).query(samples[corners])[0] > np.where(on_border, 1e-9, _BESIDE)
    points = np.concatenate([samples[corners][apart], edge])
    numbers = np.concatenate([np.flatnonzero(corners)[apart], np.arange(len(edge)) + corners.size])
    triangles = Delaunay(points).simplices
    placed = points[triangles]
    (a, b), (c, d) = (placed[:, 1] - placed[:, 0]).T, (placed[:, 2] - placed[:, 0]).T
    centre = placed.mean(axis=1)
    column, row = np.minimum(centre.astype(int), np.subtract(near.shape[::-1], 1)).T
    kept = (a * d - b * c > 1e-9) & near[row, column]
    kept[kept] = _enclosed(centre[kept], loops)
    return numbers[triangles[kept]]


def _values(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> NDArray[Any]:
    """(N,) or (N, width). Raises ValueError for what holds other than so many finite numbers."""
    width = _WIDTHS[name]
    values = np.asarray(prim.GetAttribute(f"trimCurve:{name}").Get(time))
    if values.dtype.kind not in "iuf" or values.shape[1:] != (() if width == 1 else (width,)):
        raise ValueError(f"trimCurve:{name} is missing or of another type")
    if not np.isfinite(values).all():
        raise ValueError(f"trimCurve:{name} is not finite")
    return values


def _ends(counts: NDArray[Any]) -> NDArray[np.int64]:
    """(N + 1,) where runs of so many begin, and where the last ends."""
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])


def _traced(degree: int, knots: Array, points: Array, within: Array) -> Array:
    """(N, 2) along a curve of homogeneous points (M, 3), over its range. Raises ValueError."""
    low, high = np.clip(within, knots[degree], knots[-degree - 1])
    if (np.diff(knots) < 0.0).any() or not low < high or not (points[:, 2] > 0.0).all():
        raise ValueError("a curve has descending knots, an empty range, or weights that are not positive")
    from scipy.interpolate import BSpline

    spans = np.unique([low, high, *knots[(knots > low) & (knots < high)]])
    at = np.append((spans[:-1, None] + np.diff(spans)[:, None] * (np.arange(_STEPS) / _STEPS)).ravel(), high)
    homogeneous = BSpline(knots, points, degree)(at)
    return homogeneous[:, :2] / homogeneous[:, 2:]


def _at(samples: Array, numbers: Array, parameters: Array) -> Array:
    """Where parameters lie among samples: between two at what is no whole number, beyond them as the last two go on."""
    before = np.minimum(parameters - samples[0], 0.0) / (samples[1] - samples[0])
    after = np.maximum(parameters - samples[-1], 0.0) / (samples[-1] - samples[-2])
    return np.interp(parameters, samples, numbers) + before + after


def _no_longer(loop: Array) -> Array:
    """(N, 2) the closed loop in segments of no more than _LONGEST."""
    ahead = np.roll(loop, -1, axis=0) - loop
    parts = np.ceil(np.linalg.norm(ahead, axis=1) / _LONGEST).astype(int)
    segment, part = places_in_runs(parts)
    return loop[segment] + ahead[segment] * (part / parts[segment])[:, None]


def _enclosed(points: Array, loops: list[Array]) -> NDArray[np.bool_]:
    """(P,) which points are inside."""
    first = np.concatenate(loops)
    last = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
    odd = _crossings(points, first, last) % 2 == 1
    outermost = max((_twice_area(loop) for loop in loops), key=abs)
    return odd if outermost >= 0.0 else ~odd


def _twice_area(loop: Array) -> float:
    """Negative for a clockwise one."""
    (x, y), (next_x, next_y) = loop.T, np.roll(loop, -1, axis=0).T
    return float(x @ next_y - y @ next_x)


def _crossings(points: Array, first: Array, last: Array) -> NDArray[np.intp]:
    """(P,) how many of the segments (S, 2) to (S, 2) a ray from each point along the first axis crosses.

    A segment is compared with the points beside it alone, which it finds among them in order of height.
    """
    order = np.argsort(points[:, 1])
    low, high = np.searchsorted(points[order, 1], np.sort([first[:, 1], last[:, 1]], axis=0))
    beside = high - low
    segment = np.repeat(np.arange(len(first)), beside)
    point = order[np.arange(len(segment)) + np.repeat(low - np.cumsum(beside) + beside, beside)]
    (x, y), (along_x, along_y) = first[segment].T, (last - first)[segment].T
    at = x + (points[point, 1] - y) * along_x / along_y
    return np.bincount(point[at > points[point, 0]], minlength=len(points))
