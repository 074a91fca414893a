"""Which casters coarser triangles may stand for in shadow maps, and how far off those may be.

A map's texel is often as large as many triangles of a dense mesh, which cost as much as large ones, and a dome has a
hundred maps. How coarse each map takes them follows from its own texels: passes/coarse_maps.py.
"""

from __future__ import annotations

import math
from collections.abc import Container, Sequence

from defshade_cli.plan.closed_casters import large_casters
from defshade_cli.plan.lights import PlannedLight
from defshade_cli.scene.coarse import can_be_coarse
from defshade_cli.scene.scene import Scene

_LEAST_MAPS = 16
"""Around lights' points, while a mesh stays as it is: a triangle takes 0.6 µs to be made coarser for a map's size of
texels, a dome has some three of them, and a map takes 0.06 µs to draw it."""

_SHARE = 1.0 / 16.0
"""Of a texel, in a frame of one sample. A chess set, which takes 32 CPU-seconds with all of its triangles, has 0.6 %
more relMSE to 64 samples in 20; with an eighth 1.3 % in 18, with a 32nd 0.2 % in 22."""


def coarse_casters(
    scene: Scene, lights: Sequence[PlannedLight], samples: int, moments: int, thin: Container[int]
) -> tuple[int, ...]:
    """Numbers of drawables. moments: at which samples see other geometry. thin: materials that let light through."""
    points = sum(planned.points for planned in lights if planned.light.casts_shadow)
    if points * samples < _LEAST_MAPS * max(moments, 1) or not can_be_coarse():
        return ()
    return tuple(large_casters(scene, thin))


def coarse_share(samples: int) -> float:
    """Of a texel, that triangles may be off: less in many samples, whose error is less."""
    return _SHARE / math.sqrt(samples)
