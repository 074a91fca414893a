"""Two extremes at once: corners of different families, their stages laid over each other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields, replace
from itertools import combinations

from defshade_cli.measure.stress.corner import EXACT, Corner
from defshade_cli.measure.stress.stage import StressStage

_PAIRED = (
    ("surface", "roughness 0, metallic 1"),
    ("surface", "roughness 1e-06, metallic 0"),
    ("surface", "ior 1000"),
    ("surface", "diffuse 1e20, 0, 0"),
    ("surface", "diffuse -1, 0.5, 2"),
    ("light", "intensity 1e-20"),
    ("light", "intensity 1e+10"),
    ("light", "radius 1e+06, normalize 0"),
    ("light", "inside the ball"),
    ("light", "distant angle 180"),
    ("shaping", "cone 90, softness 1"),
    ("shaping", "focus 10000"),
    ("world", "scale 1e-06"),
    ("world", "scale 1e+09"),
    ("world", "origin 1e+08"),
    ("camera", "clipping 1e-06..1e+12"),
    ("camera", "field of view 179°"),
    ("camera", "orthographic"),
    ("camera", "exposure 50"),
    ("camera", "1x1000"),
    ("transform", "ball stretched a million to one"),
    ("transform", "ball sheared"),
    ("mesh", "far point"),
    ("mesh", "opposed normals"),
)

_WHY = {
    ("focus 10000", "scale 1e-06"): "focus n makes n times as much of the rounding of its cosine",
    ("scale 1e-06", "origin 1e+08"): "so far off float64 knows places to 1.5e-8, a hundredth of the ball's radius",
}
"""Pairs that pass the bound where neither does so alone."""


def pairs(corners: Iterable[Corner]) -> Iterator[Corner]:
    """Every two of some that do not replace the same part of the stage."""
    known = {(corner.family, corner.name): corner for corner in corners}
    for one, other in combinations([known[name] for name in _PAIRED], 2):
        if not set(_changed(one)) & set(_changed(other)):
            yield _both(one, other)


def _both(one: Corner, other: Corner) -> Corner:
    stage = replace(one.stage, **{name: getattr(other.stage, name) for name in _changed(other)})
    settings = replace(
        one.settings,
        size=max(one.settings.size, other.settings.size, key=lambda size: max(size or (0, 0))),
        light_tolerance=EXACT.light_tolerance,
    )
    why = one.why or other.why or _WHY.get((one.name, other.name), "")
    return Corner("pairs", f"{one.name} and {other.name}", stage, settings, why)


def _changed(corner: Corner) -> Sequence[str]:
    """The parts of the stage that the corner replaces."""
    usual = StressStage()
    return [f.name for f in fields(usual) if getattr(corner.stage, f.name) != getattr(usual, f.name)]
