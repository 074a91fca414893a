"""Points and normals moved by joints: linear blends of matrices, or of dual quaternions.

Matrices (J, 4, 4) are skeleton_from_bind: from where the bind pose has a point to where the pose has it. Both methods
are UsdSkel's, for which UsdSkelSkinPoints is the reference.
"""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.skel.influences import Influences

Points = NDArray[np.float64]
"""(N, 3)"""


class Skinning(Protocol):
    """Moves the elements that influences are given for."""

    def points(self, points: Points, influences: Influences) -> Points:
        """The points (N, 3) bent, each by its influences."""

    def normals(self, normals: Points, influences: Influences) -> Points:
        """Not of unit length."""
        ...


@dataclass(frozen=True)
class LinearBlend:
    """Σ wᵢ Mᵢ p; normals take the inverse transposes."""

    joints: NDArray[np.float64]

    def points(self, points: Points, influences: Influences) -> Points:
        """(N, 3) by the blended matrices."""
        blended = _blend(influences, self.joints[:, :3])
        return np.einsum("nij,nj->ni", blended[..., :3], points) + blended[..., 3]

    def normals(self, normals: Points, influences: Influences) -> Points:
        """(N, 3) by the inverse transposes, of any length."""
        return np.einsum("nij,nj->ni", _blend(influences, inverse_transposes(self.joints[:, :3, :3])), normals)


@dataclass(frozen=True)
class DualQuaternionBlend:
    """Kavan et al. 2008, "Geometric Skinning with Approximate Dual Quaternion Blending".

    Each matrix is a scale S, then a rotation and a translation: the scales are blended linearly. Quaternions are on
    the hemisphere of that of a point's heaviest joint.
    """

    joints: NDArray[np.float64]

    def points(self, points: Points, influences: Influences) -> Points:
        """(N, 3) by the blended dual quaternions, scaled before."""
        real, dual = self._blended(influences)
        scaled = np.einsum("nij,nj->ni", _blend(influences, self._scales), points) if self._is_scaled else points
        return _rotated(real, scaled) + 2.0 * _imaginary_of_product(dual, real)

    def normals(self, normals: Points, influences: Influences) -> Points:
        """(N, 3) by the blended rotations, and the inverse transposes of scales; of any length."""
        real, _ = self._blended(influences)
        if self._is_scaled:
            normals = np.einsum("nij,nj->ni", _blend(influences, inverse_transposes(self._scales)), normals)
        return _rotated(real, normals)

    @cached_property
    def _rotations(self) -> NDArray[np.float64]:
        """(J, 3, 3) the orthogonal factors of the polar decompositions, without reflection."""
        u, _, vt = np.linalg.svd(self.joints[:, :3, :3])
        return (u @ vt) * np.linalg.det(u @ vt)[:, None, None]

    @cached_property
    def _scales(self) -> NDArray[np.float64]:
        return self._rotations.transpose(0, 2, 1) @ self.joints[:, :3, :3]

    @cached_property
    def _is_scaled(self) -> bool:
        return not np.allclose(self._scales, np.eye(3), atol=1e-6)

    @cached_property
    def _quaternions(self) -> NDArray[np.float64]:
        """(J, 8) real and dual part, each x y z w."""
        from scipy.spatial.transform import Rotation

        real = Rotation.from_matrix(self._rotations).as_quat()
        x, w = real[:, :3], real[:, 3:]
        t = 0.5 * self.joints[:, :3, 3]
        dual = np.concatenate([w * t + np.cross(t, x), -np.einsum("ji,ji->j", t, x)[:, None]], axis=1)
        return np.concatenate([real, dual], axis=1)

    def _blended(self, influences: Influences) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(N, 4) unit real and dual parts; the identity where the weights cancel."""
        real = self._quaternions[:, :4]
        alike = np.einsum("nki,ni->nk", real[influences.joints], real[influences.heaviest])
        blended = influences.with_weights(np.where(alike < 0.0, -1.0, 1.0) * influences.weights) @ self._quaternions
        length = np.linalg.norm(blended[:, :4], axis=1, keepdims=True)
        lost = length[:, 0] == 0.0
        blended[lost] = (0, 0, 0, 1, 0, 0, 0, 0)
        length[lost] = 1.0
        return blended[:, :4] / length, blended[:, 4:] / length


def inverse_transposes(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """(J, 3, 3) for normals; the cofactors alone of a singular matrix, which differ by the determinant."""
    x, y, z = np.moveaxis(matrices, 2, 0)
    cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=2)
    determinant = np.einsum("ji,ji->j", x, cofactors[:, :, 0])
    return cofactors / np.where(determinant == 0.0, 1.0, determinant)[:, None, None]


def _blend(influences: Influences, matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, ...) weighted sums of matrices (J, ...)."""
    return (influences.matrix @ matrices.reshape(len(matrices), -1)).reshape(-1, *matrices.shape[1:])


def _rotated(quaternions: NDArray[np.float64], vectors: Points) -> Points:
    xyz, w = quaternions[:, :3], quaternions[:, 3:]
    return vectors + 2.0 * np.cross(xyz, np.cross(xyz, vectors) + w * vectors)


def _imaginary_of_product(dual: NDArray[np.float64], real: NDArray[np.float64]) -> Points:
    """(N, 3) of dual · conjugate(real): half the translation."""
    d, r = dual[:, :3], real[:, :3]
    return real[:, 3:] * d - dual[:, 3:] * r - np.cross(d, r)
