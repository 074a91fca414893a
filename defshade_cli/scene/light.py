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
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.arrays import frozen
from defshade_cli.scene.environment import Environment, SkyLayout
from defshade_cli.scene.shadow import PLAIN, ShadowStyle
from defshade_cli.scene.shaping import Shaping
from defshade_cli.spaces import Matrix, normalize

if TYPE_CHECKING:
    from defshade_cli.scene.linking import Links
    from defshade_cli.scene.radiance_map import RadianceMap
    from defshade_cli.scene.texture import ImageFile

Profile = Literal["uniform", "cosine", "sine"]
_GAIN: dict[Profile, float] = {"uniform": 0.25, "cosine": 1.0, "sine": 1.0 / math.pi}


@dataclass(frozen=True, eq=False, kw_only=True)
class Light(ABC):
    """What all lights share.

    world_from_light: (4, 4) float64, scale included: sizes are world-space ones.
    color: (3,) float64 scene-linear, colour temperature multiplied in.
    diffuse, specular: UsdLux's multipliers of the two responses.
    group: name of the light group; empty without one.
    links: None where all geometry is lit and casts shadows.
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
    shadow: ShadowStyle = PLAIN
    group: str = ""
    links: Links | None = None

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

    @cached_property
    def axis(self) -> NDArray[np.float64]:
        """(3,) unit: the direction of emission, −Z of the light."""
        return normalize(-self.world_from_light[:3, 2])

    @property
    def frame(self) -> NDArray[np.float64]:
        """(3, 3) unit columns: the light's X and Y made square to its Z, and Z; mirrored where the light is."""
        z = -self.axis
        x = self.world_from_light[:3, 0] - z * float(np.dot(z, self.world_from_light[:3, 0]))
        y = self.world_from_light[:3, 1]
        x = normalize(x)
        return np.column_stack([x, np.cross(z, x) * (-1.0 if np.dot(np.cross(z, x), y) < 0.0 else 1.0), z])

    @property
    def spread(self) -> float:
        """How far points of the light lie from `position`, in the world; the sine of half a distant light's angle."""
        return 0.0

    @cached_property
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
    def spread(self) -> float:
        return math.sin(min(math.radians(self.angle) / 2, math.pi / 2))

    @property
    def irradiance(self) -> NDArray[np.float64]:
        """(3,) lux on a surface that faces the light."""
        return self.emission * self.power_scale


@dataclass(frozen=True, eq=False, kw_only=True)
class DomeLight(Light):
    """Light from all around; `normalize` does not concern it.

    texture: file of the sky's image, None for an even one.  layout: how the image shows it.
    environment: the sky itself where it is not a file's, in light space.
    """

    texture: ImageFile | None = None
    layout: SkyLayout = "automatic"
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
    def spread(self) -> float:
        return 0.0 if self.treat_as_point else self.world_radius

    @property
    def world_radius(self) -> float:
        """The greatest, where the transform makes an ellipsoid of the sphere."""
        return self.radius * float(self._stretches[0])

    @cached_property
    def _stretches(self) -> NDArray[np.float64]:
        """(3,) of the transform along the ellipsoid's axes, the greatest first."""
        return np.asarray(np.linalg.svd(self.world_from_light[:3, :3], compute_uv=False), np.float64)

    @cached_property
    def size_factor(self) -> float:
        """Area of the ellipsoid that the transform makes: 4π R_G(a²b², a²c², b²c²) (DLMF 19.33.1)."""
        a, b, c = ((self.radius * self._stretches) ** 2).tolist()
        if math.isclose(a, c, rel_tol=1e-12):
            return 4.0 * math.pi * a
        from scipy.special import elliprg  # a quarter of a second to import, and few lights are ellipsoids

        return 4.0 * math.pi * float(elliprg(a * b, a * c, b * c))


@dataclass(frozen=True, eq=False, kw_only=True)
class DiskLight(Light):
    radius: float = 0.5
    kind = "disk"
    profile = "cosine"

    @property
    def spread(self) -> float:
        return self.radius * float(np.linalg.norm(self.world_from_light[:3, :2], ord=2))

    @property
    def size_factor(self) -> float:
        x, y = self.world_from_light[:3, 0], self.world_from_light[:3, 1]
        return math.pi * self.radius**2 * float(np.linalg.norm(np.cross(x, y)))


@dataclass(frozen=True, eq=False, kw_only=True)
class RectLight(Light):
    """texture: an image on its face, upright to what it lights; radiance_map: the same in memory, as the plan reads it.

    The image multiplies the light, and `emission` is the mean over the face.
    """

    width: float = 1.0
    height: float = 1.0
    texture: ImageFile | None = None
    radiance_map: RadianceMap | None = None
    kind = "rect"
    profile = "cosine"

    @property
    def emission(self) -> NDArray[np.float64]:
        even = super().emission
        return even * self.radiance_map.mean if self.radiance_map else even

    @property
    def spread(self) -> float:
        x, y = self.world_from_light[:3, 0] * self.width, self.world_from_light[:3, 1] * self.height
        return 0.5 * float(max(np.linalg.norm(x + y), np.linalg.norm(x - y)))

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
    def spread(self) -> float:
        scale_x, *across = np.linalg.norm(self.world_from_light[:3, :3], axis=0)
        return float(np.hypot(0.5 * self.length * scale_x, self.radius * max(across)))

    @property
    def size_factor(self) -> float:
        scale_x, scale_y, scale_z = np.linalg.norm(self.world_from_light[:3, :3], axis=0)
        return 2.0 * math.pi * self.radius * self.length * float(scale_x * math.sqrt(scale_y * scale_z))
