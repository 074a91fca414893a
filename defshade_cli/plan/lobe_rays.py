"""Which lights lobes see by rays of each pixel's own: those of some size, hidden by a tree of solid triangles at most.

Rays know neither opacity nor which light a caster is for, and a tree takes 3 µs and 80 bytes a triangle. Domes are
worth them always, lamps where some lobe is so narrow that it sees parts of them. In a single sample blurred lobes show
small lamps as well, at half the price.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from defshade_cli.plan.lights import PlannedLight
from defshade_cli.plan.points import LARGE, apparent_size, narrowest_lobe
from defshade_cli.scene.environment import LUMINANCE
from defshade_cli.scene.light import DistantLight, DomeLight, Light
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.shadow import PLAIN
from defshade_cli.settings import RenderSettings

MOST_TRIANGLES = 1 << 20
"""Of all instances."""

TRIANGLES_A_SAMPLE = 1 << 16
"""Of lamps: a tree that takes some 0.2 s for each sample that it serves."""

MOST_LAMPS = 16
"""Each ray looks for each of them; those that light the scene most."""

NARROW = 0.5
"""Alpha of the narrowest lobe, over a lamp's radius over distance: lobes wider than that see it as a point."""

ROUGHEST = 0.7
"""Roughness of lobes that find any light as well by what all pixels share."""


def seen_by_rays(
    lights: Sequence[PlannedLight], scene: Scene, settings: RenderSettings, *, thin: bool
) -> tuple[PlannedLight, ...]:
    """The lights, marked; none where there is no geometry. thin: something lets light through."""
    if thin or scene.is_empty:
        return tuple(lights)
    chosen = {planned.number for planned in (*_domes(lights, scene, settings), *_lamps(lights, scene, settings))}
    return tuple(replace(planned, by_rays=planned.number in chosen) for planned in lights)


def roughest_rays(lights: Iterable[PlannedLight], scene: Scene) -> float:
    """Roughness from which on surfaces send no rays: alpha is twice what sees the largest lamp as a point."""
    seen = [planned.light for planned in lights if planned.by_rays]
    if any(isinstance(light, DomeLight) for light in seen):
        return ROUGHEST
    largest = max((apparent_size(light, scene.roomy_bounds) for light in seen), default=0.0)
    return min(math.sqrt(2.0 * largest / NARROW), ROUGHEST)


def _domes(lights: Iterable[PlannedLight], scene: Scene, settings: RenderSettings) -> list[PlannedLight]:
    domes = [planned for planned in lights if isinstance(planned.light, DomeLight) and planned.points]
    return [dome for dome in domes if _is_plainly_hidden(dome.light, scene, settings, MOST_TRIANGLES)]


def _is_lamp(light: Light) -> bool:
    from defshade_cli.scene.lamp import lamp_of

    return lamp_of(light, np.zeros(3)) is not None


def _lamps(lights: Iterable[PlannedLight], scene: Scene, settings: RenderSettings) -> list[PlannedLight]:
    few = min(MOST_TRIANGLES, TRIANGLES_A_SAMPLE * settings.most_samples)
    least = max(narrowest_lobe(scene.materials) * NARROW, LARGE if settings.most_samples == 1 else 0.0)
    lamps = [
        planned
        for planned in lights
        if planned.points * settings.most_samples > 1
        and not planned.samples_whole
        and apparent_size(planned.light, scene.roomy_bounds) >= least
        and _is_lamp(planned.light)
        and _is_plainly_hidden(planned.light, scene, settings, few)
    ]
    return sorted(lamps, key=lambda planned: -_brightness(planned.light, scene))[:MOST_LAMPS]


def _is_plainly_hidden(light: Light, scene: Scene, settings: RenderSettings, most: int) -> bool:
    """By nothing, or by all geometry alike, of which there is not more than `most`."""
    if not (settings.shadows and light.casts_shadow):
        return True
    linked = light.links is not None and not light.links.casts.all()
    return light.shadow == PLAIN and not linked and scene.triangle_count <= most


def _brightness(light: Light, scene: Scene) -> float:
    """About what it sends to the middle of the geometry."""
    strength = float(light.emission @ LUMINANCE) * light.power_scale
    if isinstance(light, DistantLight):
        return strength
    apart = scene.roomy_bounds.mean(axis=0) - light.position
    return strength / max(float(apart @ apart), light.spread**2)
