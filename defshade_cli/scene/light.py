"""Lights in the terms of UsdLux: radiance in nits, shapes in the light's own space, emission along −Z.

A light seen from afar is a point with an intensity; `Light.intensity_on_axis` and `Light.profile` are that far field:

    I(ω) = L · A_projected(ω)        sphere  L · A/4            (Cauchy: a convex body's mean projected area)
                                     disk, rect  L · A · cosθ   (one side)
                                     cylinder  L · A/π · sinθ   (no caps; θ from its X axis)

Formulas: the UsdLux schema text (LightAPI, ShapingAPI and the light types) of usd-core.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.arrays import frozen
from defshade_cli.scene.environment import Environment
from defshade_cli.spaces import Matrix, normalize

Profile = Literal["uniform", "cosine", "sine"]
_GAIN: dict[Profile, float] = {"uniform": 0.25, "cosine": 1.0, "sine": 1.0 / math.pi}


@dataclass(frozen=True, slots=True)
class Shaping:
    """UsdLuxShapingAPI. Angles in degrees off the light's axis; focus_tint scene-linear.

    ies_file: authored path of a profile, kept for reports.
    """

    focus: float = 0.0
    focus_tint: tuple[float, float, float] = (0.0, 0.0, 0.0)
    cone_angle: float = 90.0
    cone_softness: float = 0.0
    ies_file: str | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Light(ABC):
    """What all lights share.

    world_from_light: (4, 4) float64, scale included: sizes are world-space ones.
    color: (3,) float64 scene-linear, colour temperature multiplied in.
    diffuse, specular: UsdLux's multipliers of the two responses.
    """

    path: str
    world_from_light: Matrix
    color: NDArray[np.float64]
    intensity: float = 1.0
    exposure: float = 0.0
    normalize: bool = False
    diffuse: float = 1.0
    specular: float = 1.0
    shaping: Shaping | None = None
    casts_shadow: bool = True

    kind: ClassVar[str]
    is_infinite: ClassVar[bool] = False
    profile: ClassVar[Profile] = "uniform"

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_light", frozen(self.world_from_light, np.float64, 4, 4))
        object.__setattr__(self, "color", frozen(self.color, np.float64, 3))

    @property
    def position(self) -> NDArray[np.float64]:
        """(3,) world space."""
        return self.world_from_light[:3, 3]

    @property
    def axis(self) -> NDArray[np.float64]:
        """(3,) unit: the direction of emission, −Z of the light."""
        return normalize(-self.world_from_light[:3, 2])

    @property
    def emission(self) -> NDArray[np.float64]:
        """(3,) color · intensity · 2^exposure, before normalisation by size; nits."""
        return self.color * (self.intensity * math.exp2(self.exposure))

    @property
    @abstractmethod
    def size_factor(self) -> float:
        """The divisor that `normalize` stands for: world-space area, or the distant light's projected solid angle."""

    @property
    def radiance(self) -> NDArray[np.float64]:
        """(3,) nits. Infinite for a normalised light without size; the far field below is not."""
        return self.emission / self.size_factor if self.normalize else self.emission

    @property
    def power_scale(self) -> float:
        """radiance · size_factor / emission: 1 when normalised, so that a size of zero keeps its limit."""
        return 1.0 if self.normalize else self.size_factor

    @property
    def intensity_on_axis(self) -> NDArray[np.float64]:
        """(3,) candela-like: the far field where its profile is greatest, shaping left out."""
        return self.emission * (self.power_scale * _GAIN[self.profile])


@dataclass(frozen=True, eq=False, kw_only=True)
class DistantLight(Light):
    """angle: diameter of the disc in the sky, degrees."""

    angle: float = 0.53
    kind = "distant"
    is_infinite = True

    @property
    def size_factor(self) -> float:
        half = min(max(math.radians(self.angle) / 2, 0.0), math.pi)
        if half == 0.0:
            return 1.0
        squared = math.sin(half) ** 2
        return math.pi * (squared if half <= math.pi / 2 else 2.0 - squared)

    @property
    def irradiance(self) -> NDArray[np.float64]:
        """(3,) lux on a surface that faces the light."""
        return self.emission * self.power_scale


@dataclass(frozen=True, eq=False, kw_only=True)
class DomeLight(Light):
    """Light from all around; `normalize` does not concern it.

    texture: file of the sky's latitude-longitude image, None for an even one.
    environment: the sky itself where it is not a file's, in light space.
    """

    texture: str | None = None
    environment: Environment | None = None
    kind = "dome"
    is_infinite = True

    @property
    def size_factor(self) -> float:
        return 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class SphereLight(Light):
    """radius in light space; treat_as_point: the radius enters the power only."""

    radius: float = 0.5
    treat_as_point: bool = False
    kind = "sphere"

    @property
    def world_radius(self) -> float:
        """The greatest, where the transform makes an ellipsoid of the sphere."""
        return self.radius * float(np.linalg.norm(self.world_from_light[:3, :3], ord=2))

    @property
    def size_factor(self) -> float:
        """Area of the ellipsoid that the transform makes: 4π R_G(a²b², a²c², b²c²) (DLMF 19.33.1)."""
        a, b, c = (self.radius * np.linalg.svd(self.world_from_light[:3, :3], compute_uv=False)) ** 2
        if np.isclose(a, c, rtol=1e-12):
            return 4.0 * math.pi * float(a)
        from scipy.special import elliprg  # a quarter of a second to import, and few lights are ellipsoids

        return 4.0 * math.pi * float(elliprg(a * b, a * c, b * c))


@dataclass(frozen=True, eq=False, kw_only=True)
class DiskLight(Light):
    radius: float = 0.5
    kind = "disk"
    profile = "cosine"

    @property
    def size_factor(self) -> float:
        x, y = self.world_from_light[:3, 0], self.world_from_light[:3, 1]
        return math.pi * self.radius**2 * float(np.linalg.norm(np.cross(x, y)))


@dataclass(frozen=True, eq=False, kw_only=True)
class RectLight(Light):
    width: float = 1.0
    height: float = 1.0
    kind = "rect"
    profile = "cosine"

    @property
    def size_factor(self) -> float:
        x, y = self.world_from_light[:3, 0], self.world_from_light[:3, 1]
        return self.width * self.height * float(np.linalg.norm(np.cross(x, y)))


@dataclass(frozen=True, eq=False, kw_only=True)
class CylinderLight(Light):
    """Along the light's X axis, no caps. A scale across the axis counts as its geometric mean."""

    radius: float = 0.5
    length: float = 1.0
    kind = "cylinder"
    profile = "sine"

    @property
    def size_factor(self) -> float:
        scale_x, scale_y, scale_z = np.linalg.norm(self.world_from_light[:3, :3], axis=0)
        return 2.0 * math.pi * self.radius * self.length * float(scale_x * math.sqrt(scale_y * scale_z))
