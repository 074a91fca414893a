"""The bases of cubic curves, and their samples as sparse weights over the control points.

Segments, wraps and counts: the UsdGeomBasisCurves schema text. A pinned curve has a phantom point before its first and
after its last, 2 P₀ − P₁ and 2 Pₙ₋₁ − Pₙ₋₂.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.polygons.polygons import Primvar
from defshade_cli.usd.values import places_in_runs

if TYPE_CHECKING:  # scipy is a quarter of a second to import, and not every stage has curves
    from scipy import sparse

Weights: TypeAlias = "sparse.csr_array"

DETAILS = (32, 16, 8, 4, 2)
"""Samples a segment of cubic curves: the finest that the prim's budget allows."""

_BASES: dict[str, tuple[int, NDArray[np.float64]]] = {
    "linear": (1, np.array([[1, -1], [0, 1]], np.float64)),
    "bezier": (3, np.array([[1, -3, 3, -1], [0, 3, -6, 3], [0, 0, 3, -3], [0, 0, 0, 1]], np.float64)),
    "bspline": (1, np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]]) / 6.0),
    "catmullRom": (1, np.array([[0, -1, 2, -1], [2, 0, -5, 3], [0, 1, 4, -3], [0, 0, -1, 1]]) / 2.0),
}
"""vstep, and of each control point of a segment the coefficients of 1, t, t², t³."""


@dataclass(frozen=True, slots=True)
class Kind:
    """basis: or `linear`.  wrap: as authored."""

    basis: str
    wrap: str

    @property
    def closed(self) -> bool:
        """Whether curves end where they begin."""
        return self.wrap == "periodic"

    @property
    def pinned(self) -> bool:
        """Whether curves are carried on to their first and last control points."""
        return self.wrap == "pinned" and self.basis in ("bspline", "catmullRom")

    def segments(self, counts: NDArray[np.int64]) -> NDArray[np.int64]:
        """(K,) segments of curves with so many points, 0 for one that has too few."""
        step, basis = _BASES[self.basis]
        extended = counts + 2 * self.pinned
        found = counts // step if self.closed else (extended - len(basis)) // step + 1
        open_fits, closed_fits = (counts >= 2) & (extended >= len(basis)), (counts >= 3) & (counts % step == 0)
        fits = closed_fits if self.closed else open_fits
        return np.where(fits, np.maximum(found, 0), 0)

    def elements(self, counts: NDArray[np.int64], points: int) -> dict[str, int]:
        """How many values each interpolation needs on curves of so many points each, (C,)."""
        varying = int((self.segments(counts) + (0 if self.closed else 1)).sum())
        return {
            "constant": 1,
            "uniform": len(counts),
            "vertex": points,
            "varying": varying,
            "faceVarying": varying,
        }


@dataclass(frozen=True, eq=False, slots=True)
class CurveSamples:
    """S samples along curves.

    curve: (S,) the authored curve of each, ascending.  closed: whether a curve's last sample is followed by its first.
    vertex, varying: (S, points) and (S, varying values) weights.
    """

    curve: NDArray[np.intp]
    closed: bool
    vertex: Weights
    varying: Weights

    @property
    def count(self) -> int:
        """How many samples there are of all curves."""
        return len(self.curve)

    def at(self, primvar: Primvar) -> NDArray[np.float64]:
        """(S, ...) the values of a primvar at the samples."""
        values = primvar.values.astype(np.float64)
        match primvar.interpolation:
            case "constant":
                return np.broadcast_to(values, (self.count, *values.shape[1:]))
            case "uniform":
                return values[self.curve]
            case "vertex":
                return self.vertex @ values
            case _:
                return self.varying @ values


def sample_curves(kind: Kind, counts: NDArray[np.int64], points: int, detail: int) -> CurveSamples:
    """Samples of curves of so many points each, (C,), `detail` a segment; a linear one needs one."""
    detail = 1 if kind.basis == "linear" else detail
    segments = kind.segments(counts)
    rows = segments * detail + np.where(segments > 0, not kind.closed, 0)
    curve, place = places_in_runs(rows)
    segment = np.minimum(place // detail, segments[curve] - 1)
    return sample_at(kind, counts, points, Places(curve, segment, (place - segment * detail) / detail))


class Places(NamedTuple):
    """(S,) places along curves: the curve, its segment, and how far along that, 0..1."""

    curve: NDArray[np.intp]
    segment: NDArray[np.intp]
    t: NDArray[np.float64]


def sample_at(kind: Kind, counts: NDArray[np.int64], points: int, places: Places) -> CurveSamples:
    """Weights that take control points to the places. counts: (C,) control points of each curve; points: of all."""
    varying_counts = kind.segments(counts) + (0 if kind.closed else 1)
    return CurveSamples(
        places.curve,
        kind.closed,
        _vertex_weights(kind, counts, points, places, _powers(kind, places.t) @ _BASES[kind.basis][1].T),
        _varying_weights(kind, varying_counts, places),
    )


def control_samples(kind: Kind, counts: NDArray[np.int64], points: int, closed: bool) -> CurveSamples:
    """A sample at every control point (P,), as if the curves were lines between these, closed ones or open."""
    segments = kind.segments(counts)
    rows = np.where(segments > 0, counts, 0)
    curve, place = places_in_runs(rows)
    along = place * segments[curve] / np.maximum(counts - (0 if kind.closed else 1), 1)[curve]
    segment = np.minimum(along.astype(np.intp), segments[curve] - 1)
    samples = sample_at(kind, counts, points, Places(curve, segment, along - segment))
    own = (np.cumsum(counts) - counts)[curve] + place
    vertex = sparse_weights(np.ones(len(own)), np.arange(len(own)), own, (len(own), points))
    return replace(samples, vertex=vertex, closed=closed)


def tangent_weights(kind: Kind, counts: NDArray[np.int64], points: int, places: Places) -> Weights:
    """(S, points) of the derivative along t."""
    size = len(_BASES[kind.basis][1])
    slopes = np.arange(size) * _powers(kind, places.t)[:, [0, *range(size - 1)]]
    return _vertex_weights(kind, counts, points, places, slopes @ _BASES[kind.basis][1].T)


def control_weights(kind: Kind, counts: NDArray[np.int64], points: int, places: Places) -> tuple[Weights, ...]:
    """(S, points) each: the control points of the segments, one after the other."""
    choices = np.eye(len(_BASES[kind.basis][1]))
    repeated = (np.broadcast_to(choice, (len(places.t), len(choice))) for choice in choices)
    return tuple(_vertex_weights(kind, counts, points, places, weights) for weights in repeated)


def _powers(kind: Kind, t: NDArray[np.float64]) -> NDArray[np.float64]:
    """(S, 2 or 4) 1, t, t², t³"""
    return t[:, None] ** np.arange(len(_BASES[kind.basis][1]))


def _vertex_weights(
    kind: Kind, counts: NDArray[np.int64], points: int, places: Places, weights: NDArray[np.float64]
) -> Weights:
    """(S, points) what `weights` (S, 2 or 4) of the control points of their segments are of all points."""
    curve, segment, _ = places
    step, basis = _BASES[kind.basis]
    size = len(basis)
    own = segment[:, None] * step + np.arange(size) - kind.pinned
    if kind.closed:
        own %= counts[curve, None]
    first = np.cumsum(counts) - counts
    column = first[curve, None] + own
    phantom = points + 2 * curve[:, None]
    column = np.where(own < 0, phantom, np.where(own >= counts[curve, None], phantom + 1, column))
    row = np.repeat(np.arange(len(curve)), size)
    extended = sparse_weights(weights.ravel(), row, column.ravel(), (len(curve), points + 2 * len(counts)))
    return extended @ _with_phantoms(first, counts, points)


def _with_phantoms(first: NDArray[np.int64], counts: NDArray[np.int64], points: int) -> Weights:
    """(points + 2 curves, points) every point, then the two phantoms of each curve of two points and more."""
    curve = np.flatnonzero(counts >= 2)
    start, end = first[curve], (first + counts - 1)[curve]
    before, after = points + 2 * curve, points + 2 * curve + 1
    row = np.concatenate([np.arange(points), before, before, after, after])
    column = np.concatenate([np.arange(points), start, start + 1, end, end - 1])
    ones = np.ones(len(curve))
    weight = np.concatenate([np.ones(points), 2 * ones, -ones, 2 * ones, -ones])
    return sparse_weights(weight, row, column, (points + 2 * len(counts), points))


def _varying_weights(kind: Kind, varying_counts: NDArray[np.int64], places: Places) -> Weights:
    """(S, varying values) linear from one end of a segment to the other."""
    curve, segment, t = places
    first = (np.cumsum(varying_counts) - varying_counts)[curve]
    following = (segment + 1) % varying_counts[curve] if kind.closed else segment + 1
    row = np.tile(np.arange(len(curve)), 2)
    column = np.concatenate([first + segment, first + following])
    weight = np.concatenate([1.0 - t, t])
    return sparse_weights(weight, row, column, (len(curve), int(varying_counts.sum())))


def sparse_weights(weight: NDArray[Any], row: NDArray[Any], column: NDArray[Any], shape: tuple[int, int]) -> Weights:
    """A matrix of so many rows and columns from (N,) weights and where each lies."""
    from scipy import sparse

    return sparse.csr_array((weight, (row, column)), shape=shape)
