"""Pictures of a whole sky in other layouts than latitude and longitude.

Mirrored balls and angular maps are seen from outside: their centre shows +Z, their right +X, their rim −Z. A vertical
cross is seen from within, like a latitude-longitude map: +Z in its centre, +X on its left, −Z upside down at its foot.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.environment import SkyLayout

_FACES: dict[tuple[int, int], tuple[tuple[int, int, int], tuple[int, int, int], tuple[int, int, int]]] = {
    (1, 0): ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    (0, 1): ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    (1, 1): ((0, 0, 1), (-1, 0, 0), (0, -1, 0)),
    (2, 1): ((-1, 0, 0), (0, 0, -1), (0, -1, 0)),
    (1, 2): ((0, -1, 0), (-1, 0, 0), (0, 0, -1)),
    (1, 3): ((0, 0, -1), (-1, 0, 0), (0, 1, 0)),
}
"""Cell of the cross, by column and row → where its middle, its right and its lower edge look."""


def latlong_from(pixels: NDArray[np.float32], layout: SkyLayout) -> NDArray[np.float32]:
    """(H, W, 3) pixels of a layout as a latitude-longitude map; `automatic` takes 3 : 4 images for vertical crosses."""
    height, width = pixels.shape[:2]
    if layout == "automatic":
        layout = "cubeMapVerticalCross" if 4 * width == 3 * height else "latlong"
    match layout:
        case "mirroredBall":
            return _read(pixels, *_on_ball(_directions(height)))
        case "angular":
            return _read(pixels, *_on_disc(_directions(height)))
        case "cubeMapVerticalCross":
            return _from_cross(pixels)
    return pixels


def _directions(height: int) -> NDArray[np.float64]:
    """(height, 2 · height, 3) that a latitude-longitude map's pixels show."""
    latitude = np.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    longitude = 2.0 * np.pi * (0.5 - (np.arange(2 * height) + 0.5) / (2 * height))[None, :]
    parts = np.sin(longitude) * np.cos(latitude), np.sin(latitude), np.cos(longitude) * np.cos(latitude)
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def _on_ball(d: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where a mirroring ball, seen along −Z, reflects +Z into `d`: half-way between."""
    half = d + np.array([0.0, 0.0, 1.0])
    half = half / np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-12)
    return 0.5 + 0.5 * half[..., 0], 0.5 - 0.5 * half[..., 1]


def _on_disc(d: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    across = np.hypot(d[..., 0], d[..., 1])
    scale = np.arctan2(across, d[..., 2]) / np.pi / np.maximum(across, 1e-12)
    return 0.5 + 0.5 * scale * d[..., 0], 0.5 - 0.5 * scale * d[..., 1]


def _from_cross(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    side = pixels.shape[0] // 4
    d = _directions(2 * side)
    sky = np.zeros((*d.shape[:2], pixels.shape[2]), np.float32)
    for (column, row), axes in _FACES.items():
        forward, right, down = (d @ np.array(axis, np.float64) for axis in axes)
        seen = forward >= np.abs(d).max(axis=-1) * (1.0 - 1e-12)
        face = pixels[row * side : (row + 1) * side, column * side : (column + 1) * side]
        x, y = 0.5 + 0.5 * right[seen] / forward[seen], 0.5 + 0.5 * down[seen] / forward[seen]
        sky[seen] = _read(face, x, y)
    return sky


def _read(pixels: NDArray[np.float32], x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float32]:
    """Bilinear at places in [0, 1] from the left and the top, edges repeated."""
    height, width = pixels.shape[:2]
    across, down = np.clip(x * width - 0.5, 0.0, width - 1.0), np.clip(y * height - 0.5, 0.0, height - 1.0)
    i, j = np.minimum(across.astype(int), width - 2), np.minimum(down.astype(int), height - 2)
    i, j = np.maximum(i, 0), np.maximum(j, 0)
    s, t = (across - i)[..., None], (down - j)[..., None]
    right, below = np.minimum(i + 1, width - 1), np.minimum(j + 1, height - 1)
    upper = pixels[j, i] * (1.0 - s) + pixels[j, right] * s
    lower = pixels[below, i] * (1.0 - s) + pixels[below, right] * s
    return (upper * (1.0 - t) + lower * t).astype(np.float32)
