"""Where Gf's row vectors become the house's column vectors: every matrix is transposed here, once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Vt

from defshade_cli.spaces import Matrix

IDENTITY = Gf.Matrix4d(1.0)


def matrix(gf: Gf.Matrix4d) -> Matrix:
    """(4, 4) float64 `b_from_a` of (4, 4), (4, 4), USD's "a to b"."""
    return np.frombuffer(gf).reshape(4, 4).T.copy()


def gf_matrix(b_from_a: Matrix) -> Gf.Matrix4d:
    """USD's "a to b" of (4, 4)."""
    return Gf.Matrix4d(b_from_a.T.tolist())


def matrices(gf: Vt.Matrix4dArray | Sequence[Gf.Matrix4d]) -> NDArray[np.float64]:
    """(N, 4, 4) float64 likewise."""
    array = gf if isinstance(gf, Vt.Matrix4dArray) else Vt.Matrix4dArray(gf)
    return np.asarray(array, np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)
