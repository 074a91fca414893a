"""Lights whose shape is a mesh: its triangles shine outwards."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.arrays import frozen
from defshade_cli.scene.distribution import cumulative, step_at
from defshade_cli.scene.environment import LUMINANCE
from defshade_cli.scene.light import Light
from defshade_cli.spaces import cofactors, normalize, transform_points

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class MeshLight(Light):
    """corners: (T, 3, 3) float64, the triangles in light space, counter-clockwise seen from outside.

    tints: (T, 3) float64 on the radiance of each; `emission` is the mean over the surface.
    """

    corners: NDArray[np.float64]
    tints: NDArray[np.float64]
    kind = "mesh"

    def __post_init__(self) -> None:
        super().__post_init__()
        count = len(self.corners)
        object.__setattr__(self, "corners", frozen(self.corners, np.float64, count, 3, 3))
        object.__setattr__(self, "tints", frozen(self.tints, np.float64, count, 3))

    @property
    def emission(self) -> Vector:
        return super().emission * self._mean_tint

    @property
    def size_factor(self) -> float:
        """Area of the surface in the world."""
        return float(self._world_areas.sum())

    @property
    def position(self) -> Vector:
        """(3,) world space: the centre of the light that the surface gives."""
        weights = self._world_areas * (self.tints @ LUMINANCE)
        if weights.sum() == 0.0:
            return self.world_from_light[:3, 3]
        centroid = weights @ self.corners.mean(axis=1) / weights.sum()
        return transform_points(self.world_from_light, centroid)

    @property
    def spread(self) -> float:
        corners = transform_points(self.world_from_light, self.corners.reshape(-1, 3))
        return float(np.linalg.norm(corners - self.position, axis=1).max(initial=0.0))

    def draw(self, u: tuple[float, float]) -> tuple[Vector, Vector, float, Vector]:
        """A point of the surface in light space, its unit normal, the area that it stands for, and its weight (3,).

        Drawn in proportion to area and luminance; area times weight is radiance over density, in units of the mean.
        Square to triangle: Heitz 2019, "A Low-Distortion Map Between Triangle and Square".
        """
        place, s = step_at(self._distribution, u[0])
        index = int(self._order[place])
        s, t = (s / 2.0, u[1] - s / 2.0) if u[1] > s else (s - u[1] / 2.0, u[1] / 2.0)
        a, b, c = self.corners[index]
        point = a + (b - a) * s + (c - a) * t
        luminance = float(self.tints[index] @ LUMINANCE)
        if luminance <= 0.0:
            return point, self._normals[index], 0.0, np.zeros(3)
        mean = self._mean_tint
        weight = np.divide(self.tints[index], mean, out=np.zeros(3), where=mean > 0)
        return point, self._normals[index], float(self._weights.sum()) / luminance, weight

    @cached_property
    def _crosses(self) -> NDArray[np.float64]:
        a, b, c = self.corners.transpose(1, 0, 2)
        return np.cross(b - a, c - a)

    @cached_property
    def _areas(self) -> NDArray[np.float64]:
        return 0.5 * np.linalg.norm(self._crosses, axis=1)

    @cached_property
    def _normals(self) -> NDArray[np.float64]:
        return normalize(self._crosses)

    @cached_property
    def _world_areas(self) -> NDArray[np.float64]:
        return 0.5 * np.linalg.norm(self._crosses @ cofactors(self.world_from_light[:3, :3]).T, axis=1)

    @cached_property
    def _mean_tint(self) -> Vector:
        total = self.size_factor
        return self._world_areas @ self.tints / total if total > 0.0 else np.zeros(3)

    @cached_property
    def _weights(self) -> NDArray[np.float64]:
        return self._areas * (self.tints @ LUMINANCE)

    @cached_property
    def _order(self) -> NDArray[np.intp]:
        """Triangles along Morton's curve, so that neighbours are neighbours and strata are patches of the surface."""
        centres = self.corners.mean(axis=1)
        low, extent = centres.min(axis=0), np.maximum(np.ptp(centres, axis=0).max(), np.finfo(float).tiny)
        cells = ((centres - low) / extent * 1023.0).astype(np.uint64)
        bits = np.arange(10, dtype=np.uint64)
        spread = (cells[:, :, None] >> bits & np.uint64(1)) << (np.uint64(3) * bits)
        codes = (spread.sum(axis=2) << np.arange(3, dtype=np.uint64)).sum(axis=1)
        return np.argsort(codes, kind="stable")

    @cached_property
    def _distribution(self) -> NDArray[np.float64]:
        return cumulative(self._weights[self._order])
