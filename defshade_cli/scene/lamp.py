"""The shapes of lights as a ray meets them, with how densely the points that stand for them lie there.

scene/emission.py draws the points; here is their number by area, turned about: what one of them stands for at a place.
Shapes are of unit size in a space of their own, so that a ray is taken there once and the formulas have no sizes:
shaders/lib/lamps.glsl.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.emission import POINTS_BIAS, turn_towards
from defshade_cli.scene.light import CylinderLight, DiskLight, DistantLight, Light, RectLight, SphereLight
from defshade_cli.scene.radiance_map import RadianceMap
from defshade_cli.spaces import Matrix, is_similarity

Shape = Literal["ball", "sphere", "disk", "rect", "cylinder", "cone"]


@dataclass(frozen=True, slots=True, eq=False)
class Lamp:
    """world_from_lamp: (4, 4); the shape is of radius 1 there, or reaches from −1 to 1, and emits as UsdLux has it.

    area: that one point would stand for, in the lamp's own space; a distant light's solid angle.
    radius: of what is around all of it, in the world; of a distant light the chord of its half angle.
    bias: (2,) along Y and Z, by which a cylinder's points turn to what is lit.
    shown: what a rectangle shows.
    """

    shape: Shape
    world_from_lamp: Matrix
    area: float
    radius: float
    bias: tuple[float, float] = (0.0, 0.0)
    shown: RadianceMap | None = None

    @property
    def stretch(self) -> float:
        """Volume in the world of a unit cube of the lamp's space."""
        return abs(float(np.linalg.det(self.world_from_lamp[:3, :3])))


def lamp_of(light: Light, towards: NDArray[np.float64], *, inside: bool = True) -> Lamp | None:
    """None for a light without a size, or whose shape is none of these. towards: (3,), inside: as for `emitter_at`."""
    if light.spread <= 0.0 or light.size_factor == 0.0:
        return None
    match light:
        case DistantLight(angle=angle):
            half = min(math.radians(angle) / 2, math.pi)
            return Lamp("cone", np.eye(4), 2.0 * math.pi * (1.0 - math.cos(half)), 2.0 * math.sin(half / 2))
        case SphereLight(radius=r):
            ball = inside and is_similarity(light.world_from_light)
            area = math.pi * light.world_radius**2 if ball else 4.0 * math.pi
            return _sized("ball" if ball else "sphere", light, (r, r, r), area)
        case DiskLight(radius=r):
            return _sized("disk", light, (r, r, 1.0), math.pi)
        case RectLight(width=w, height=h, radiance_map=shown):
            return _sized("rect", light, (w / 2, h / 2, 1.0), 4.0, shown=shown)
        case CylinderLight(radius=r, length=length):
            turn = math.tau * turn_towards(light, towards)
            bias = POINTS_BIAS * math.cos(turn), POINTS_BIAS * math.sin(turn)
            return _sized("cylinder", light, (length / 2, r, r), 4.0 * math.pi, bias)
    return None


def _sized(
    shape: Shape,
    light: Light,
    size: tuple[float, float, float],
    area: float,
    bias: tuple[float, float] = (0.0, 0.0),
    shown: RadianceMap | None = None,
) -> Lamp | None:
    world_from_lamp = light.world_from_light @ np.diag([*size, 1.0])
    lamp = Lamp(shape, world_from_lamp, area, light.spread, bias, shown)
    return lamp if lamp.stretch > 0.0 else None
