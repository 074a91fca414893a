"""How fine shadow maps are: as fine as one can be for few lights, coarser where many share a frame.

Among many lights each adds little, or reaches little of the image: what a texel of its shadow is off weighs as much
less. So a sample draws about as many texels whatever the lights, until maps are as small as is worth it.
"""

from __future__ import annotations

import math

from defshade_cli.plan.lights import PlannedLight
from defshade_cli.scene.light import DomeLight

FINEST, COARSEST = 1024, 128
"""Texels along the side of a map."""

_TEXELS = 64 * FINEST**2
"""Of all maps of a sample."""

_CUBE_FACES = 6

_SKY_MAPS = 4
"""Of a dome, that count: more of them are drawn in turn, and are as fine."""


def shadow_resolution(maps: float) -> int:
    """Texels along the side of each of some maps that a sample draws, a power of two."""
    side = math.sqrt(_TEXELS / max(maps, 1.0))
    return min(max(2 ** round(math.log2(side)), COARSEST), FINEST)


def count_maps(planned: PlannedLight) -> int:
    """Shadow maps that a light may need in a sample."""
    if not planned.light.casts_shadow:
        return 0
    if isinstance(planned.light, DomeLight):
        return min(planned.points, _SKY_MAPS)
    return planned.points * (1 if planned.light.is_infinite else _CUBE_FACES)
