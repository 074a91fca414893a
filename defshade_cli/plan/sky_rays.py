"""Whether lobes see a dome by rays of each pixel's own: where what may hide it is a tree of solid triangles.

Rays know neither opacity nor which light a caster is for, and a tree takes 3 µs and 80 bytes a triangle.
"""

from __future__ import annotations

from collections.abc import Sequence

from defshade_cli.plan.lights import PlannedLight
from defshade_cli.plan.points import rays_a_sample
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.shadow import PLAIN
from defshade_cli.settings import RenderSettings

MOST_TRIANGLES = 1 << 20
"""Of all instances."""


def count_sky_rays(lights: Sequence[PlannedLight], scene: Scene, settings: RenderSettings, *, thin: bool) -> int:
    """Of a pixel in a sample; 0 where directions that all pixels share must do."""
    domes = [planned for planned in lights if isinstance(planned.light, DomeLight) and planned.points]
    if not domes:
        return 0
    casting = [dome.light for dome in domes if settings.shadows and dome.light.casts_shadow]
    if thin or (casting and scene.triangle_count > MOST_TRIANGLES):
        return 0
    if any(light.shadow != PLAIN or (light.links and not light.links.casts.all()) for light in casting):
        return 0
    return rays_a_sample(settings)
