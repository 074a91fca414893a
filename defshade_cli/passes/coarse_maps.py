"""How coarse shadow maps take their casters: as far off as a share of their texels, and as much deeper.

What is seen lies on the mesh itself, and coarser triangles may lie before it: they are stored deeper by as much as they
may be off, and by the same share of their slopes, so that none shades the surface that it stands for.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.draw_list import CASTER_FRONTS, DrawList
from defshade_cli.scene.camera import Camera
from defshade_cli.spaces import transform_points


def coarse_levels(draws: DrawList, cameras: Sequence[Camera], resolution: int, share: float) -> NDArray[np.float64]:
    """(M, D) binary logarithms of lengths in object space, for draws.coarse; −∞ where nothing coarser will do.

    cameras: of M maps.  share: of a texel; 0 for none.
    """
    corners, scales = draws.corners[draws.coarse.first], draws.coarse.scales
    if not len(scales) or share <= 0.0:
        return np.full((len(cameras), len(scales)), -np.inf)
    texels = np.array([_texels(camera, corners) for camera in cameras]).reshape(-1, len(scales)) / resolution
    with np.errstate(divide="ignore", invalid="ignore"):
        levels = np.floor(np.log2(share * texels / scales))
    return np.where(np.isfinite(levels), levels, -np.inf)


def _texels(camera: Camera, corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(D,) the least side of a map where boxes (D, 8, 3) are nearest to its eye; 0 around the eye."""
    left, right, bottom, top = camera.window
    side = min(right - left, top - bottom)
    if camera.projection == "orthographic":
        return np.full(len(corners), side)
    nearest = -transform_points(camera.camera_from_world, corners)[..., 2].max(axis=1)
    return np.asarray(side * np.maximum(nearest, 0.0))


def divided_runs(
    draws: DrawList, places: NDArray[np.intp], seen: NDArray[np.bool_], fronts: NDArray[np.int8]
) -> tuple[NDArray[np.bool_], list[NDArray[Any]]]:
    """Which of the (C,) commands that a map sees it draws as they are, and what stands for others, by CASTER_FRONTS.

    places: (D, 2) of the coarser triangles that the map takes.
    """
    coarse = draws.coarse
    stands = places[:, 1] > 0
    commands = coarse.commands(draws.table, places)
    shown, sides = stands & seen[coarse.first], fronts[coarse.first]
    replaced = np.append(stands, False)[coarse.of]
    return seen & ~replaced, [commands[shown & (sides == side)] for side in CASTER_FRONTS]
