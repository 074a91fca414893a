"""How a light shines less off its axis: UsdLuxShapingAPI."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from defshade_cli.dataclass import dataclass

if TYPE_CHECKING:
    from defshade_cli.scene.ies import IesProfile


@dataclass(frozen=True, slots=True)
class Shaping:
    """Angles in degrees off the light's axis; focus_tint scene-linear.

    ies: a profile of its own, measured from the light's axis; ies_angle_scale stretches its vertical angles.
    ies_normalize: the profile's mean counts as 1, so that it leaves the light's power.
    """

    focus: float = 0.0
    focus_tint: tuple[float, float, float] = (0.0, 0.0, 0.0)
    cone_angle: float = 90.0
    cone_softness: float = 0.0
    ies: IesProfile | None = None
    ies_angle_scale: float = 0.0
    ies_normalize: bool = False

    @property
    def ies_scale(self) -> float:
        """What the profile's candela are multiplied with; 0 without one, or where a normalised one gives no light."""
        if self.ies is None or not self.ies_normalize:
            return float(self.ies is not None)
        return 1.0 / self.ies.mean if self.ies.mean > 0.0 else 0.0

    @property
    def ies_vertical(self) -> tuple[float, float]:
        """(a, b): the profile is read at a · θ + b radians, within 0 and π, for light that leaves at θ off the axis."""
        scale = self.ies_angle_scale
        if scale == 0.0:
            return 1.0, 0.0
        return (1.0 / scale, 0.0) if scale > 0.0 else (-1.0 / scale, math.pi + math.pi / scale)

    @property
    def peak(self) -> float:
        """The greatest factor that shaping puts on what leaves one way; a tint may pass 1."""
        tint = max(1.0, *self.focus_tint)
        return tint if self.ies is None else tint * self.ies.peak * self.ies_scale
