"""How the shadows of a light look, where they are not simply black: UsdLuxShadowAPI."""

from __future__ import annotations

from defshade_cli.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class ShadowStyle:
    """color: scene-linear, what a full shadow leaves of the light.

    distance: from a surface to the farthest occluder that shades it, scene units; negative for no limit.
    falloff: depth of the zone before that in which shadows fade.  gamma: exponent of that fading.
    """

    color: tuple[float, float, float] = (0.0, 0.0, 0.0)
    distance: float = -1.0
    falloff: float = -1.0
    gamma: float = 1.0

    @property
    def fading(self) -> float:
        """The zone's depth, no more than the distance; 0 for none."""
        return min(max(self.falloff, 0.0), max(self.distance, 0.0))


PLAIN = ShadowStyle()
