"""The lights that are drawn, their volumes and how far they reach.

Reach of a light. Outside its volume a light may add no more than its share of `light_tolerance` to a pixel, so that
all that is dropped stays below it. With the far field I/d² and a bound K on BRDF · NoL of the scene's materials,

    reach² = exposure · I_max · K · lights / light_tolerance,    K = 1/π + 1/(2π α³) + clearcoat/(2π αc³)

(GGX: D ≤ 1/(πα²); both visibility terms: V·NoL ≤ 1/(2α); F ≤ 1; the greatest K of the scene's materials). No light
reaches further than the geometry does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.image.light_texture import with_texture
from defshade_cli.plan.bounds import SLACK
from defshade_cli.plan.groups import group_lights, light_groups, light_outputs
from defshade_cli.plan.overlap import reaches_into_ball
from defshade_cli.plan.points import (
    MIN_ALPHA,
    NEAREST_WHOLE,
    apparent_size,
    narrowest_lobe,
    points_of,
    samples_whole,
    share_points,
)
from defshade_cli.scene.light import DistantLight, Light, SphereLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings, Shading

Volume = Literal["quad", "sphere", "cone"]


@dataclass(frozen=True, slots=True, eq=False)
class PlannedLight:
    """light: with its texture in memory.  number: its place among the scene's lights.

    reach: radius of the volume in scene units, infinite for a quad.
    is_empty: no geometry lies within a sphere light.
    groups: the layers that sum it.
    samples_whole: the first samples, in which it shows as a whole, see plan/points.py; 0 for a light that never does.
    points: that stand for the light in each sample; 1 is its far field where there is a single sample.
    by_rays: lobes see it by rays of each pixel's own as well, see plan/lobe_rays.py.
    """

    light: Light
    volume: Volume
    reach: float
    number: int = 0
    is_empty: bool = True
    groups: tuple[str, ...] = ()
    points: int = 1
    by_rays: bool = False
    samples_whole: int = 0


def volume_of(light: Light) -> Volume:
    """Distant and dome lights → quad; a cone of at most 90° → cone; every other light → sphere."""
    if light.is_infinite:
        return "quad"
    return "cone" if light.shaping and light.shaping.cone_angle <= 90.0 else "sphere"


def plan_lights(
    scene: Scene, exposure: float, settings: RenderSettings, layers: Sequence[str] = ()
) -> tuple[PlannedLight, ...]:
    """Lights that shine, in the order of their volumes, with reach and group. exposure: the camera's factor.

    Raises UsageError where a light is in more groups than a framebuffer takes.
    """
    lights = enumerate(with_texture(light) for light in scene.lights)
    lit = [(number, light) for number, light in lights if _peak(light) > 0.0]
    response = max((_greatest_response(m, settings.shading) for m in scene.materials), default=1.0)
    gain = exposure * response * max(len(lit), 1) / settings.light_tolerance
    order: dict[str, int] = {"quad": 0, "sphere": 1, "cone": 2}
    groups = group_lights([light for _, light in lit], light_groups(layers), light_outputs(layers))
    sizes = [apparent_size(light, scene.roomy_bounds) for _, light in lit]
    points = share_points(sizes, settings)
    narrowest = narrowest_lobe(scene.materials)
    planned = [
        PlannedLight(
            light=light,
            volume=volume_of(light),
            reach=_reach(light, scene.roomy_bounds, gain),
            number=number,
            is_empty=_is_empty(light, scene),
            groups=of_light,
            points=points_of(light, count, settings),
            samples_whole=samples_whole(light, count, size, narrowest, settings)
            if _is_empty(light, scene, NEAREST_WHOLE)
            else 0,
        )
        for (number, light), of_light, count, size in zip(lit, groups, points, sizes, strict=True)
    ]
    return tuple(sorted(planned, key=lambda p: (order[p.volume], p.groups)))


def _greatest_response(material: Material, shading: Shading) -> float:
    """K of this file's first lines, each lobe with its own α; the classic equation has no coat.

    What an image holds is not known here: it may be the worst.
    """
    lobes = [(1.0, 0.0 if "roughness" in material.inputs else material.roughness)]
    if shading == "preview-surface":
        amount = 1.0 if "clearcoat" in material.inputs else material.clearcoat
        lobes.append((amount, 0.0 if "clearcoat_roughness" in material.inputs else material.clearcoat_roughness))
    return sum(amount / max(roughness**2, MIN_ALPHA) ** 3 for amount, roughness in lobes) / math.tau + 1.0 / math.pi


def _peak(light: Light) -> float:
    """What the light can send one way: all of L · A, which no profile exceeds, as its shaping turns it."""
    strength = light.irradiance if isinstance(light, DistantLight) else light.emission * light.power_scale
    shaping = light.shaping.peak if light.shaping else 1.0
    return float(np.max(strength)) * max(light.diffuse, light.specular) * shaping


def _reach(light: Light, bounds: NDArray[np.float64], gain: float) -> float:
    if light.is_infinite:
        return math.inf
    farthest = np.max(np.abs(bounds - light.position), axis=0)
    geometry = float(np.linalg.norm(farthest)) * (1.0 + SLACK)
    return min(math.sqrt(_peak(light) * gain), geometry)


def _is_empty(light: Light, scene: Scene, radii: float = 1.0) -> bool:
    if not isinstance(light, SphereLight) or light.treat_as_point:
        return True
    return not reaches_into_ball(scene, light.position, radii * light.world_radius)
