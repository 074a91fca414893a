"""How fine shadow maps are: as fine as one can be for few lights, coarser where many share a frame.

Among many lights each adds little, or reaches little of the image: what a texel of its shadow is off weighs as much
less. So a sample draws about as many texels whatever the lights, until maps are as small as is worth it. Samples strew
the texels of their maps: a few of them err more by their number than by maps half as fine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from defshade_cli.plan.lights import PlannedLight
from defshade_cli.scene.light import DomeLight

FINEST, FINE, COARSEST = 1024, 512, 128
"""Texels along the side of a map."""

_FEW = range(2, 16)
"""Samples that FINE is enough for: at 8 relMSE of a stage with soft shadows is 1.04 times as large."""

_MANY, _MANY_DIRECTIONS = 4, 64
"""Points of each light, and directions of a dome among them, that FINE is enough for too."""

_TEXELS = 64 * FINEST**2
"""Of all maps of a sample."""

ATLAS = 4096
"""Texels along the side of what holds maps together."""

MOST_KEPT = 4
"""Atlases that keep their maps from frame to frame: 64 MiB each."""

CUBE_FACES = 6
"""Maps of a point that has geometry all around."""

_SKY_MAPS = 4
"""Of a dome, that make maps coarser: it may draw more of them, as fine, since solid casters cost little a texel."""


def shadow_resolution(lights: Sequence[PlannedLight], samples: int, *, thin: bool) -> int:
    """Texels along the side of each map, a power of two. thin: some casters may let light through, texel by texel."""
    sky_maps = math.inf if thin else _SKY_MAPS
    counted = sum(min(count_maps(p), sky_maps if isinstance(p.light, DomeLight) else math.inf) for p in lights)
    side = math.sqrt(_TEXELS / max(counted, 1))
    finest = FINE if samples in _FEW or _are_many(lights) else FINEST
    return min(max(2 ** math.ceil(math.log2(side) - 0.5), COARSEST), finest)


def _are_many(lights: Sequence[PlannedLight]) -> bool:
    """Does each map weigh little, under a dome?"""
    casting = [planned for planned in lights if planned.light.casts_shadow]
    least = min((planned.points for planned in casting), default=0)
    return least >= _MANY and any(p.points >= _MANY_DIRECTIONS for p in casting if isinstance(p.light, DomeLight))


def count_maps(planned: PlannedLight) -> int:
    """Shadow maps that a light may need in a sample."""
    if not planned.light.casts_shadow:
        return 0
    return planned.points * (1 if planned.light.is_infinite else CUBE_FACES)
