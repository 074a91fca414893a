"""Frames and the matrices between them.

Matrices are named `b_from_a`, act on column vectors (`p_b = b_from_a @ p_a`) and stay float64 on the CPU.

    object    a mesh's own points
    world     the stage: its up axis and units as authored
    relative  world axes with the origin at the camera: what the GPU sees, so that a scene 10^7 units
              from the origin renders like one at the origin
    camera    right-handed, +X right, +Y up, looking along −Z
    clip      before the divide; x, y in [−w, w], y up
    raster    pixels, (0, 0) at the top-left corner of the image, y down
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]
Triple = tuple[float, float, float]
Window = tuple[float, float, float, float]
ConformPolicy = Literal["expandAperture", "cropAperture", "adjustApertureWidth", "adjustApertureHeight"]


def translation(offset: NDArray[Any]) -> Matrix:
    """(4, 4) matrix that adds `offset` (3,)."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def cross(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    """Cross products of vectors (..., 3). np.cross takes ten times as long for a few."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def transform_points(b_from_a: Matrix, points: NDArray[Any]) -> NDArray[np.float64]:
    """Points (..., 3) of frame a in frame b; affine matrices only."""
    return points @ b_from_a[:3, :3].T + b_from_a[:3, 3]


def transform_directions(b_from_a: Matrix, directions: NDArray[Any]) -> NDArray[np.float64]:
    """Directions (..., 3), not renormalised."""
    return directions @ b_from_a[:3, :3].T


def normalize(vectors: NDArray[Any]) -> NDArray[Any]:
    """Unit vectors (..., 3) of the same dtype; a zero vector stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def rigid(matrix: Matrix) -> Matrix:
    """The nearest rotation (polar decomposition, by SVD), same translation: a camera ignores scale and shear."""
    u, _, vt = np.linalg.svd(matrix[:3, :3])
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    result = np.eye(4)
    result[:3, :3] = rotation
    result[:3, 3] = matrix[:3, 3]
    return result


def cofactors(matrix: NDArray[Any]) -> NDArray[np.float64]:
    """det(M) M⁻ᵀ, with the sign that keeps outward normals outward under a mirror."""
    x, y, z = matrix.T
    areas = np.column_stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)])
    return areas * (-1.0 if np.dot(x, areas[:, 0]) < 0 else 1.0)


def inverse_rigid(b_from_a: Matrix) -> Matrix:
    """a_from_b of a rotation with a translation, exactly: the transpose, not a solver."""
    inverse = np.eye(4)
    inverse[:3, :3] = b_from_a[:3, :3].T
    inverse[:3, 3] = -inverse[:3, :3] @ b_from_a[:3, 3]
    return inverse


def is_similarity(matrix: Matrix) -> bool:
    """Whether spheres stay spheres, to float32's rounding."""
    scales = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    return bool(scales[0] - scales[2] <= 1e-5 * scales[0])


def frame_along(direction: NDArray[Any]) -> NDArray[np.float64]:
    """(3, 3) a rotation whose third column points along `direction` (3,); +Z for a zero vector.

    In plain floats: shadow maps ask for tens of frames a sample, and NumPy takes ten times as long for three numbers.
    """
    z = _unit(*map(float, direction)) or (0.0, 0.0, 1.0)
    x = _unit(*(_cross((0.0, 1.0, 0.0), z) if abs(z[1]) < 0.9 else _cross((1.0, 0.0, 0.0), z)))
    assert x
    return np.array([x, _cross(z, x), z]).T


def _unit(x: float, y: float, z: float) -> Triple | None:
    """None for a zero vector, and for one that is not finite."""
    length = math.hypot(x, y, z)
    return (x / length, y / length, z / length) if 0.0 < length < math.inf else None


def _cross(a: Triple, b: Triple) -> Triple:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def conform_window(window: Window, aspect: float, policy: ConformPolicy = "expandAperture") -> Window:
    """Fit (left, right, bottom, top) to the image's aspect as UsdRenderSettings' aspectRatioConformPolicy says.

    The window keeps its centre, so aperture offsets survive.
    """
    left, right, bottom, top = window
    width, height = right - left, top - bottom
    too_narrow = width / height < aspect
    fit_width = {
        "expandAperture": too_narrow,
        "cropAperture": not too_narrow,
        "adjustApertureWidth": True,
        "adjustApertureHeight": False,
    }[policy]
    if fit_width:
        half, centre = 0.5 * height * aspect, 0.5 * (left + right)
        return centre - half, centre + half, bottom, top
    half, centre = 0.5 * width / aspect, 0.5 * (bottom + top)
    return left, right, centre - half, centre + half
