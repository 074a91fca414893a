"""Blend shapes and their inbetweens as one sparse matrix a mesh, from weights to offsets."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import UsdSkel, Vt

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.values import floats, integers

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


class Offsets(NamedTuple):
    """(P, 3) what is added to points and to normals. silent: to points, by shapes that say nothing of normals."""

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    silent: NDArray[np.float64]

    def of(self, rows: NDArray[np.integer] | None) -> Offsets:
        """Of some points; None for all."""
        return self if rows is None else Offsets(*(offsets[rows] for offsets in self))


@dataclass(frozen=True, slots=True, eq=False)
class BlendShapes:
    """The shapes of P points.

    points, normals: (3P, S) offsets of each sub-shape, that is of a shape or of an inbetween at its full weight.
    silent: (S,) those without offsets of normals.
    """

    query: UsdSkel.BlendShapeQuery
    points: csr_matrix
    normals: csr_matrix
    silent: NDArray[np.bool_]

    def offsets(self, weights: NDArray[np.float32]) -> Offsets:
        """What the weights (S,) add to points and normals, (N, 3) each."""
        amounts = self._amounts(weights)
        added = (self.points @ amounts, self.normals @ amounts, self.points @ (amounts * self.silent))
        return Offsets(*(offsets.reshape(-1, 3) for offsets in added))

    def _amounts(self, weights: NDArray[np.float32]) -> NDArray[np.float64]:
        """(S,) weights of sub-shapes: USD finds the two inbetweens that a weight lies between."""
        amounts = np.zeros(self.points.shape[1])
        values, _, sub_shapes = self.query.ComputeSubShapeWeights(Vt.FloatArray.FromNumpy(weights))
        np.add.at(amounts, np.asarray(sub_shapes, np.intp), np.asarray(values))
        return amounts


def read_blend_shapes(binding: UsdSkel.BindingAPI, points: int, issues: list[str]) -> BlendShapes:
    """The shapes bound to a prim of `points` points; what does not fit them is left out, and said."""
    query = UsdSkel.BlendShapeQuery(binding)
    indices = [_point_indices(found) for found in query.ComputeBlendShapePointIndices()]
    moved, turned = list[Entries](), list[Entries]()
    for sub_shape, offsets in enumerate(query.ComputeSubShapePointOffsets()):
        shape = query.GetBlendShapeIndex(sub_shape)
        name = f"blend shape {query.GetBlendShape(shape).GetPrim().GetName()}"
        moved.append(_entries(offsets, indices[shape], points, name, issues))
        normals = _normal_offsets(query, sub_shape) if len(offsets) else None
        turned.append(_entries(normals, indices[shape], points, f"{name}: normalOffsets", issues))
    silent = np.array([not len(offsets) for _, offsets in turned], bool)
    return BlendShapes(query, _stacked(moved, points), _stacked(turned, points), silent)


Entries = tuple[NDArray[np.integer], NDArray[np.float32]]
"""Points (N,), and their offsets (N, 3)."""

_NONE: Entries = (np.empty(0, np.intp), np.empty((0, 3), np.float32))


def _point_indices(found: Vt.IntArray) -> NDArray[np.integer] | None:
    """None for all points in order."""
    indices = integers(found)
    return indices if indices is not None and len(indices) else None


def _entries(
    authored: object, indices: NDArray[np.integer] | None, points: int, name: str, issues: list[str]
) -> Entries:
    offsets = None if authored is None else floats(authored, 3)
    if offsets is None or not len(offsets):
        return _NONE
    places = np.arange(points) if indices is None else indices
    if len(offsets) != len(places):
        issues.append(f"{name} is left out: {len(offsets)} offsets where {len(places)} are due")
        return _NONE
    if not (((places >= 0) & (places < points)).all() and np.isfinite(offsets).all()):
        issues.append(f"{name} is left out: its points are out of range, or its offsets not finite")
        return _NONE
    return places, offsets


def _normal_offsets(query: UsdSkel.BlendShapeQuery, sub_shape: int) -> object:
    inbetween = query.GetInbetween(sub_shape)
    if inbetween:
        return inbetween.GetNormalOffsets()
    return query.GetBlendShape(query.GetBlendShapeIndex(sub_shape)).GetNormalOffsetsAttr().Get()


def _stacked(entries: list[Entries], points: int) -> csr_matrix:
    """(3P, S) with one column a sub-shape."""
    from scipy.sparse import coo_matrix, csr_matrix

    if not entries:
        return csr_matrix((3 * points, 0))
    rows = [(3 * places[:, None] + np.arange(3)).ravel() for places, _ in entries]
    columns = [np.full(len(row), number) for number, row in enumerate(rows)]
    values = [offsets.ravel() for _, offsets in entries]
    data = (np.concatenate(values).astype(np.float64), (np.concatenate(rows), np.concatenate(columns)))
    return coo_matrix(data, shape=(3 * points, len(entries))).tocsr()
