"""The point that stands for a light in one sample: its far field, or a point on its surface.

A surface point emits L cosθ dA. Under the light's transform M a patch with local normal n and area a becomes
a · |cof(M) n|, so I = L · A_local · |cof(M) n| for points uniform in the shape's own coordinates; averaged over samples
this is the integral over the true, sheared or stretched, surface. A distant light emits L over its cone of directions.

All pixels share a sample's point, and points that face away from many of them are wasted. A sphere has none of those:
a ball that glows at each point alike in all directions, L / (π √(R² − r²)) a unit of length, is seen alike, as

    ∫ ds / (π √(h² − s²)) = 1   over a chord of half length h,  R² − r² = h² − s²    (Abel's integral)

so that each of its points bears the same intensity L π R². A cylinder's points are drawn by the limaçon
1 + 0.8 cos φ around the direction of what is lit.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.environment import Environment, harmonics
from defshade_cli.scene.light import (
    CylinderLight,
    DiskLight,
    DistantLight,
    DomeLight,
    Light,
    Profile,
    RectLight,
    SphereLight,
)
from defshade_cli.scene.mesh_light import MeshLight
from defshade_cli.spaces import cofactors, is_similarity, normalize, transform_points

if TYPE_CHECKING:
    from defshade_cli.scene.distribution import GridDistribution

Vector = NDArray[np.float64]
Place = tuple[float, float, float]
"""Coordinates in the unit cube."""

POINTS_BIAS = 0.8
"""Of a cylinder's points; at 1 those that face away would bear any intensity, and something may face them."""


@dataclass(frozen=True, slots=True, eq=False)
class Emitter:
    """position: (3,) world space.  axis: (3,) unit, what shaping is measured from; a distant light's direction.
    facing: (3,) unit, what the profile is measured from.  intensity: (3,) on axis, or a distant light's irradiance.
    extent: world-space area that the point stands for, a distant light's solid angle in steradians; 0 for a point.
    radius: of the glowing ball around the light's position that the point lies in; 0 for another.
    shown: what shines in its place, where the point casts shadows alone.
    """

    position: Vector
    axis: Vector
    facing: Vector
    profile: Profile
    intensity: Vector
    extent: float = 0.0
    radius: float = 0.0
    shown: Emitter | None = None

    @property
    def falloff_limit(self) -> float:
        """What 1 / distance² counts as at most: no patch covers more than a hemisphere, extent / distance² of it.

        Patches shrink with the number of samples, so that the mean still converges.
        """
        return 2.0 * math.pi / self.extent if self.extent else math.inf

    def shared_by(self, samples: int) -> Emitter:
        """One of `samples` points that stand for the light together."""
        return replace(self, extent=self.extent / samples)

    def one_of(self, points: int) -> Emitter:
        """One of `points` that shine in the same sample."""
        return replace(self, intensity=self.intensity / points, extent=self.extent / points)

    def shown_as(self, light: Light, share: float) -> Emitter:
        """As a disc that is a `share` of a round light's, nearer to its middle: size and place vary as the light."""
        near = math.sqrt(1.0 - share)
        position = light.position + near * (self.position - light.position)
        axis = normalize(light.axis + near * (self.axis - light.axis))
        return replace(self, shown=replace(self, position=position, axis=axis, extent=share * self.extent))

    def relative_to(self, origin: Vector) -> Emitter:
        """The same with positions counted from `origin`."""
        return replace(self, position=self.position - origin)


@dataclass(frozen=True, slots=True, eq=False)
class _Patch:
    """A point of a light's surface in light space, its unit normal, and the area that it stands for.

    weight: (3,) on the light's mean radiance.
    """

    point: Vector
    normal: Vector
    area: float
    weight: Vector | float = 1.0


def far_field(light: Light) -> Emitter:
    """The light from afar: all of its power at its position."""
    if isinstance(light, DistantLight):
        return Emitter(light.position, light.axis, light.axis, "uniform", light.irradiance)
    facing = normalize(light.world_from_light[:3, 0]) if light.profile == "sine" else light.axis
    return Emitter(light.position, light.axis, facing, light.profile, light.intensity_on_axis)


def emitter_at(light: Light, u: Place, towards: Vector, *, inside: bool = True) -> Emitter:
    """The light's point at `u`; lights without size give their far field.

    towards: (3,) world space, the middle of what is lit.
    inside: points may lie within a sphere, where no geometry does.
    """
    if isinstance(light, DistantLight):
        return _distant(light, u)
    if inside and isinstance(light, SphereLight) and not light.treat_as_point and is_similarity(light.world_from_light):
        return _within_ball(light, u)
    patch = _patch(light, u, towards)
    if patch is None or patch.area == 0.0 or light.size_factor == 0.0:
        return far_field(light)
    cofactor = cofactors(light.world_from_light[:3, :3]) @ patch.normal
    stretch = float(np.linalg.norm(cofactor))
    intensity = light.radiance * patch.weight * (patch.area * stretch)
    position = transform_points(light.world_from_light, patch.point)
    return Emitter(position, light.axis, normalize(cofactor), "cosine", intensity, patch.area * stretch)


def sky_emitter(
    light: DomeLight,
    sky: Environment,
    u: tuple[float, float],
    share: float,
    density: GridDistribution | None = None,
    balance: Vector | None = None,
) -> Emitter:
    """A direction of the dome drawn by its sky's radiance, or by a `density`, bearing `share` of the whole.

    balance: of all directions of a render, see Environment.balance.
    """
    direction, weight, extent = sky.sample(u, density)
    if balance is not None:
        weight = weight * np.maximum(1.0 + harmonics(direction) @ balance, 0.0)
    axis = -normalize(light.world_from_light[:3, :3] @ direction)
    return Emitter(light.position, axis, axis, "uniform", light.emission * weight * share, extent * share)


def _within_ball(light: SphereLight, u: Place) -> Emitter:
    """A point of the glowing ball: uniform over the disc that its axis sees, then along the chord through it."""
    x, y = _circle(u[1], light.radius * math.sqrt(u[0]))
    z = light.radius * math.sqrt(1.0 - u[0]) * math.sin(math.pi * (u[2] - 0.5))
    position = transform_points(light.world_from_light, np.array([x, y, z]))
    radius = light.world_radius
    return Emitter(position, light.axis, light.axis, "uniform", light.intensity_on_axis, math.pi * radius**2, radius)


def _distant(light: DistantLight, u: Place) -> Emitter:
    """Directions uniform in the light's cone of solid angle 2π(1 − cosθ)."""
    half = min(max(math.radians(light.angle) / 2, 0.0), math.pi)
    if half == 0.0:
        return far_field(light)
    z = 1.0 - u[0] * (1.0 - math.cos(half))
    local = np.array([*_circle(u[1], math.sqrt(max(1.0 - z * z, 0.0))), z])
    x = normalize(light.world_from_light[:3, 0] - light.axis * np.dot(light.axis, light.world_from_light[:3, 0]))
    axis = normalize(np.column_stack([x, np.cross(light.axis, x), light.axis]) @ local)
    solid_angle = 2.0 * math.pi * (1.0 - math.cos(half))
    return Emitter(light.position, axis, axis, "uniform", light.radiance * solid_angle, solid_angle)


def _patch(light: Light, u: Place, towards: Vector) -> _Patch | None:
    match light:
        case MeshLight():
            return _Patch(*light.draw(u[:2]))
        case SphereLight(treat_as_point=False, radius=r):
            z = 1.0 - 2.0 * u[0]
            normal = np.array([*_circle(u[1], math.sqrt(max(1.0 - z * z, 0.0))), z])
            return _Patch(r * normal, normal, 4.0 * math.pi * r * r)
        case DiskLight(radius=r):
            return _Patch(np.array([*_circle(u[1], r * math.sqrt(u[0])), 0.0]), _FORWARD, math.pi * r * r)
        case RectLight(width=w, height=h, radiance_map=None):
            return _Patch(np.array([(u[0] - 0.5) * w, (u[1] - 0.5) * h, 0.0]), _FORWARD, w * h)
        case RectLight(width=w, height=h, radiance_map=shown) if shown is not None:
            (s, t), weight, density = shown.sample(u[:2])  # its top left is at (+X, +Y)
            return _Patch(np.array([(0.5 - s) * w, (0.5 - t) * h, 0.0]), _FORWARD, w * h / density, weight * density)
        case CylinderLight(radius=r, length=length):
            turn, density = _limacon(u[1])
            normal = np.array([0.0, *_circle(turn + turn_towards(light, towards), 1.0)])
            return _Patch(r * normal + [(u[0] - 0.5) * length, 0.0, 0.0], normal, math.tau * r * length / density)
    return None


_FORWARD = np.array([0.0, 0.0, -1.0])


def turn_towards(light: Light, towards: Vector) -> float:
    """Of a place in the world around the light's X axis from Y, in turns."""
    y, z = np.linalg.solve(light.world_from_light[:3, :3], towards - light.position)[1:]
    return math.atan2(z, y) / math.tau


def _limacon(u: float) -> tuple[float, float]:
    """The turn within ±1/2 at quantile `u` of the density 1 + POINTS_BIAS cos(2π · turn), and its density."""
    low, high = -0.5, 0.5
    for _ in range(40):
        turn = 0.5 * (low + high)
        below = turn + POINTS_BIAS * math.sin(math.tau * turn) / math.tau + 0.5 < u
        low, high = (turn, high) if below else (low, turn)
    return turn, 1.0 + POINTS_BIAS * math.cos(math.tau * turn)


def _circle(turn: float, radius: float) -> tuple[float, float]:
    angle = 2.0 * math.pi * turn
    return radius * math.cos(angle), radius * math.sin(angle)
