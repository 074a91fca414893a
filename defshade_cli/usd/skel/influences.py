"""Which joints move a point, and how much."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdSkel

from defshade_cli.dataclass import dataclass

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


@dataclass(frozen=True, eq=False)
class Influences:
    """The influences of N elements, K each.

    joints: (N, K) integers, in the order that the skinned prim gives its joints.
    weights: (N, K) float64; 1 together, but what is authored counts as it is.
    joint_count: how many joints there are.
    """

    joints: NDArray[np.integer]
    weights: NDArray[np.float64]
    joint_count: int

    @cached_property
    def matrix(self) -> csr_matrix:
        """(N, joint_count): the weighted sum over joints."""
        return self.with_weights(self.weights)

    @cached_property
    def heaviest(self) -> NDArray[np.integer]:
        """(N,) the joint of the largest weight, the first of equals."""
        return np.take_along_axis(self.joints, self.weights.argmax(axis=1)[:, None], axis=1)[:, 0]

    def with_weights(self, weights: NDArray[np.float64]) -> csr_matrix:
        """A matrix (N, J) of weights (N, K), which stand at the influences' joints."""
        from scipy.sparse import csr_matrix

        count, most = self.joints.shape
        starts = np.arange(count + 1) * most
        return csr_matrix((weights.ravel(), self.joints.ravel(), starts), shape=(count, self.joint_count))

    def of(self, rows: NDArray[np.integer]) -> Influences:
        """The influences of some elements, or of one several times."""
        return Influences(self.joints[rows], self.weights[rows], self.joint_count)


def read_influences(query: UsdSkel.SkinningQuery, time: Usd.TimeCode, joint_count: int, count: int) -> Influences:
    """Influences of `count` points, or one row of a rigid prim. Raises ValueError where none are authored that fit."""
    most = query.GetNumInfluencesPerComponent()
    authored = query.ComputeJointInfluences(time)
    if most < 1 or authored is None:
        raise ValueError("its joint influences have no values")
    joints, weights = np.asarray(authored[0]), np.asarray(authored[1], np.float64)
    rows = 1 if query.IsRigidlyDeformed() else count
    if not len(joints) == len(weights) == rows * most:
        raise ValueError(f"{len(joints)} joint indices and {len(weights)} weights where {rows * most} are due")
    if not ((joints >= 0) & (joints < joint_count)).all():
        raise ValueError("its joint indices are out of range")
    if not np.isfinite(weights).all():
        raise ValueError("its joint weights are not finite")
    return Influences(joints.reshape(rows, most), weights.reshape(rows, most), joint_count)
