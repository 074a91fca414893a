"""A prim's one shape, placed as often as the prim says."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class Copies:
    """Where a prim places its one shape N times.

    object_from_copy: (N, 4, 4) float64.  ids: (N,) int32, which they are of those `authored`.
    display_color, display_opacity: (N, 3) and (N,) float32, NaN where nothing is authored.
    lines: they are bars along x, which are seen no thinner than a pixel; else they stay round, see `rounded`.
    """

    object_from_copy: NDArray[np.float64]
    ids: NDArray[np.int32]
    display_color: NDArray[np.float32]
    display_opacity: NDArray[np.float32]
    authored: int = 1
    lines: bool = False

    @property
    def positions(self) -> NDArray[np.float32]:
        """(N, 3)"""
        return self.object_from_copy[:, :3, 3].astype(np.float32)

    def moved(self, positions: NDArray[np.float32]) -> Copies:
        """The copies at other positions (N, 3), turned and scaled as they are."""
        matrices = self.object_from_copy.copy()
        matrices[:, :3, 3] = positions
        return replace(self, object_from_copy=matrices)


def once(display_color: NDArray[np.float32] | None = None, display_opacity: float | None = None) -> Copies:
    """A single copy, where the prim is. display_color: (3,)."""
    if display_color is None and display_opacity is None:
        return _ONCE
    return Copies(
        _ONCE.object_from_copy,
        _ONCE.ids,
        _ONCE.display_color if display_color is None else display_color[None],
        _ONCE.display_opacity if display_opacity is None else np.array([display_opacity], np.float32),
    )


def bars(object_from_copy: NDArray[np.float64]) -> Copies:
    """Lines between places, (N, 4, 4) of the unit bar from 0 to 1 along x."""
    count = len(object_from_copy)
    return Copies(
        object_from_copy,
        np.full(count, -1, np.int32),
        np.full((count, 3), np.nan, np.float32),
        np.full(count, np.nan, np.float32),
        lines=True,
    )


def rounded(world_from_copy: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 4, 4) that scale alike along all axes, by the length of what (1, 1, 1) / √3 becomes.

    Points stay spheres under any transform, as wide as in RenderMan and Hydra (points.glslfx).
    """
    scale = np.linalg.norm(world_from_copy[:, :3, :3].sum(axis=2), axis=1) / math.sqrt(3.0)
    round_ones = world_from_copy.copy()
    round_ones[:, :3, :3] = scale[:, None, None] * np.eye(3)
    return round_ones


_ONCE = Copies(
    np.eye(4)[None], np.full(1, -1, np.int32), np.full((1, 3), np.nan, np.float32), np.full(1, np.nan, np.float32)
)
