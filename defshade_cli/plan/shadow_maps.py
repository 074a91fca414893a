"""How fine shadow maps are: as fine as one can be for few lights, coarser where many share a frame.

Among many lights each adds little, or reaches little of the image: what a texel of its shadow is off weighs as much
less. So a sample draws about as many texels whatever the lights, until maps are as small as is worth it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from defshade_cli.plan.lights import PlannedLight
from defshade_cli.scene.light import DomeLight

FINEST, COARSEST = 1024, 128
"""Texels along the side of a map."""

_TEXELS = 64 * FINEST**2
"""Of all maps of a sample."""

CUBE_FACES = 6
"""Maps of a point that has geometry all around."""

_SKY_MAPS = 4
"""Of a dome, that make maps coarser: it may draw more of them, as fine."""


def shadow_resolution(lights: Sequence[PlannedLight]) -> int:
    """Texels along the side of each map, a power of two."""
    counted = sum(min(count_maps(p), _SKY_MAPS if isinstance(p.light, DomeLight) else math.inf) for p in lights)
    side = math.sqrt(_TEXELS / max(counted, 1))
    return min(max(2 ** round(math.log2(side)), COARSEST), FINEST)


def count_maps(planned: PlannedLight) -> int:
    """Shadow maps that a light may need in a sample."""
    if not planned.light.casts_shadow:
        return 0
    return planned.points * (1 if planned.light.is_infinite else CUBE_FACES)
