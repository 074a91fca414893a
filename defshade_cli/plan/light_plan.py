"""What is decided of the lights and shadows of a frame, and what follows from that."""

from __future__ import annotations

from typing import TYPE_CHECKING

from defshade_cli.dataclass import dataclass
from defshade_cli.plan.coarse_casters import coarse_share
from defshade_cli.plan.lights import PlannedLight
from defshade_cli.plan.shadow_maps import ATLAS, MOST_KEPT, count_maps, shadow_resolution
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.shadow import PLAIN
from defshade_cli.settings import Lighting

if TYPE_CHECKING:
    from defshade_cli.scene.ies import IesProfile


@dataclass(frozen=True, slots=True, eq=False)
class LightPlan:
    """The half of a Plan that lights are drawn by.

    samples: a pixel at most.
    lights: sorted quads, spheres, cones.  lighting: how they are drawn.
    shadows: some light casts them.  shadow_linked: in some light not all geometry does.
    lobe_rays: of a pixel in a sample, by which lobes see some lights; 0 where they see none so.
    roughest_rays: roughness of surfaces from which on they see none so.
    background: domes are seen where no geometry is.
    portals: how many hints for sampling domes the stage has.
    thin: numbers of the materials whose opacity may be below 1.
    closed: numbers of the drawables that show shadow maps their fronts alone.
    coarse: numbers of those that coarser triangles may stand for in shadow maps.
    """

    samples: int
    lights: tuple[PlannedLight, ...]
    lighting: Lighting
    shadows: bool
    shadow_linked: bool
    lobe_rays: int
    roughest_rays: float
    background: bool
    portals: int
    thin: tuple[int, ...]
    closed: tuple[int, ...]
    coarse: tuple[int, ...]

    @property
    def cutout(self) -> bool:
        """Is something drawn that may let through what lies behind it?"""
        return bool(self.thin)

    @property
    def most_groups(self) -> int:
        """Groups that a light is in."""
        return max((len(planned.groups) for planned in self.lights), default=0)

    @property
    def profiles(self) -> tuple[IesProfile, ...]:
        """The IES profiles of the lights, each once."""
        shapings = [planned.light.shaping for planned in self.lights]
        return tuple(dict.fromkeys(shaping.ies for shaping in shapings if shaping and shaping.ies))

    @property
    def domes(self) -> tuple[PlannedLight, ...]:
        """Those of the lights that are skies."""
        return tuple(planned for planned in self.lights if isinstance(planned.light, DomeLight))

    @property
    def lamps(self) -> tuple[PlannedLight, ...]:
        """Those of the lights that have a place or a size, and that lobes see by rays, groups together."""
        seen = [planned for planned in self.lights if planned.by_rays and not isinstance(planned.light, DomeLight)]
        return tuple(sorted(seen, key=lambda planned: planned.groups))

    @property
    def sky_share(self) -> float:
        """Of a dome, that one of its directions stands for, four times; 0 where it has none but its analytic term."""
        directions = max((dome.points for dome in self.domes), default=0) * self.samples
        return 4.0 / directions if directions else 0.0

    def shadows_sky(self, planned: PlannedLight) -> bool:
        """Is it a dome with directions that geometry hides?"""
        casts = self.shadows and planned.light.casts_shadow
        return isinstance(planned.light, DomeLight) and planned.points > 0 and casts

    def hides_sky(self, planned: PlannedLight) -> bool:
        """Is it a dome that geometry hides, as far as the directions drawn so far tell? Rays need not ask them."""
        return self.shadows_sky(planned) and not planned.by_rays

    @property
    def shadows_lamps(self) -> bool:
        """Does geometry hide some of the lamps?"""
        return self.shadows and any(planned.light.casts_shadow for planned in self.lamps)

    @property
    def shadow_styles(self) -> bool:
        """Are some shadows other than black, or do they end?"""
        return self.shadows and any(p.light.casts_shadow and p.light.shadow != PLAIN for p in self.lights)

    @property
    def shadow_resolution(self) -> int:
        """Texels along the side of each shadow map."""
        return shadow_resolution(self.lights, self.samples, thin=self.cutout)

    @property
    def coarse_share(self) -> float:
        """Of a shadow map's texel, that coarser triangles may be off."""
        return coarse_share(self.samples)

    @property
    def maps_a_sample(self) -> int:
        """Shadow maps that a sample may need."""
        return sum(map(count_maps, self.lights))

    @property
    def keeps_maps(self) -> bool:
        """Are its shadow maps so few that those of the next frame are drawn where they change?"""
        texels = self.maps_a_sample * self.shadow_resolution**2
        sees_alike = self.samples == 1 and not self.lobe_rays and self.lighting != "volumes"
        return self.shadows and sees_alike and texels <= MOST_KEPT * ATLAS**2
