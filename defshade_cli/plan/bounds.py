"""Volumes that light fills, and whether they meet boxes: maybe one too many, never one too few."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass

SLACK = 1e-3
"""Relative, around bounds that float32 may round outwards."""

ROUNDING = 1e-4
"""Relative, for what float32 rounds in the shaders."""


@dataclass(frozen=True, slots=True, eq=False)
class LightBounds:
    """Volumes of L lights, in any space without scales.

    centre: (L, 3).  reach: (L,), infinite for a light without a place.  axis: (L, 3) unit.
    cone_angle: (L,) radians off the axis; more than π/2 for a volume that is no cone.
    """

    centre: NDArray[np.float64]
    reach: NDArray[np.float64]
    axis: NDArray[np.float64]
    cone_angle: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.reach)

    def meet(self, lights: NDArray[np.int64], boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(N,) does the volume of each of the (N,) lights meet its (N, 2, 3) box? Empty boxes meet nothing."""
        low, high, centre, reach = boxes[:, 0], boxes[:, 1], self.centre[lights], self.reach[lights]
        aside = np.maximum(np.maximum(low - centre, centre - high), 0.0)
        met = (low <= high).all(axis=1) & (np.einsum("ni,ni->n", aside, aside) <= reach**2 * (1.0 + ROUNDING))
        cones = np.flatnonzero(met & (self.cone_angle[lights] <= np.pi / 2) & np.isfinite(reach))
        met[cones] = self._cones_meet(lights[cones], boxes[cones])
        return met

    def _cones_meet(self, lights: NDArray[np.int64], boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Spheres around the boxes, by their distance from the cones' mantles."""
        middle, half = boxes.mean(axis=1), 0.5 * (boxes[:, 1] - boxes[:, 0])
        offset, angle = middle - self.centre[lights], self.cone_angle[lights]
        along = np.einsum("ni,ni->n", offset, self.axis[lights])
        across = np.sqrt(np.maximum(np.einsum("ni,ni->n", offset, offset) - along**2, 0.0))
        radius = np.linalg.norm(half, axis=1) + ROUNDING * (np.linalg.norm(offset, axis=1) + 1e-30)
        return np.cos(angle) * across - np.sin(angle) * along <= radius
