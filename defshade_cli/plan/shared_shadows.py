"""How many pixels share what they look up of a dome's shadows.

A sample of many directions asks as many shadow maps at each pixel, and each adds little. So pixels beside each other
ask some of them each, and tell their neighbours: interleaved sampling (Keller & Heidrich 2001), of shadows alone. Where
samples bring few directions each, every pixel asks all.
"""

from __future__ import annotations

from collections.abc import Sequence

from defshade_cli.plan.lights import PlannedLight
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.shadow import PLAIN

SHARED_DIRECTIONS = 16
"""That a pixel asks for, of each number of so many."""

_MOST = 8
"""Pixels: a lattice of them has each within two pixels of any other."""

_WORTHWHILE = 2**18
"""Pixels of the image; for fewer it takes longer to compile than it saves."""


def sharing_pixels(lights: Sequence[PlannedLight], display: tuple[int, int]) -> int:
    """A power of two; 1 where none share. display: (width, height) of the whole image."""
    if display[0] * display[1] < _WORTHWHILE:
        return 1
    directions = max((planned.points for planned in lights if may_share(planned)), default=0)
    return min(max(directions // SHARED_DIRECTIONS, 1), _MOST)


def may_share(planned: PlannedLight) -> bool:
    """Is it a dome whose shadows are black?"""
    light = planned.light
    return isinstance(light, DomeLight) and light.casts_shadow and light.shadow == PLAIN
