"""How lights are drawn: what is cheapest, by how many there are and the share of the image that they cover.

A volume reads the GBuffer and blends for each pixel that it covers; tiles do so once a pixel, whatever the lights, but
bin them first; lights on the whole image need no lists, one draw for all kinds, and shine where they do not reach.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from defshade_cli.plan.lights import PlannedLight
from defshade_cli.scene.camera import Camera
from defshade_cli.settings import Lighting, RenderSettings
from defshade_cli.spaces import transform_points

VOLUME = 26.0
"""ns a pixel that a volume covers. llvmpipe, the float layout, two cores with AVX-512, as all of these."""

TILE_PIXEL, TILE_LIGHT, ARRIVING = 40.0, 12.5, 0.5
"""ns of tiles a pixel for each kind of lights, and a light there; and the share of lights with shadows that arrive in
a tile: others are left out of its list."""

WHOLE_DRAW, WHOLE_LIGHT, LIGHTS_A_DRAW = 25.0, 6.5, 12
"""ns a pixel of a draw of the whole image, and of each of its lights, of which it has so many at most."""

_WORTHWHILE = 2**18
"""Pixels of all samples; for fewer a shader in which lights are written out takes longer to compile than it saves."""

_LARGEST = 1e5
"""Sides of an orthographic view, that a volume may reach."""


def choose_lighting(
    lights: Sequence[PlannedLight],
    camera: Camera,
    settings: RenderSettings,
    layers: Sequence[str],
    pixels: int,
    *,
    shadows: bool,
) -> Lighting:
    """pixels: of the image.  shadows: does some light cast any?

    The layer lightComplexity counts volumes, so it has them where nothing is asked.
    """
    if settings.lighting != "auto":
        return settings.lighting
    if "lightComplexity" in layers:
        return "volumes"
    covered, count = covered_share(lights, camera), sum(planned.points for planned in lights)
    costs: dict[Lighting, float] = {
        "volumes": VOLUME * covered,
        "tiles": TILE_PIXEL * _count_kinds(lights, settings) + TILE_LIGHT * covered * (ARRIVING if shadows else 1.0),
        "whole": WHOLE_DRAW * math.ceil(count / LIGHTS_A_DRAW) + WHOLE_LIGHT * count,
    }
    if pixels * settings.most_samples < _WORTHWHILE:
        del costs["whole"]
    if not _can_be_clipped(lights, camera):
        del costs["volumes"]
    return min(costs, key=costs.__getitem__)


def _count_kinds(lights: Sequence[PlannedLight], settings: RenderSettings) -> int:
    """Of lights that tiles draw apart: by their groups, shape and shadows."""
    return len({(p.groups, p.light.shaping is not None, settings.shadows and p.light.is_infinite) for p in lights})


def _can_be_clipped(lights: Sequence[PlannedLight], camera: Camera) -> bool:
    """Are all volumes small enough for a rasteriser that clips in float32? Perspective views widen towards them."""
    left, right, bottom, top = camera.window
    reaches = [planned.reach for planned in lights if math.isfinite(planned.reach)]
    largest = _LARGEST * min(right - left, top - bottom)
    return camera.projection == "perspective" or max(reaches, default=0.0) < largest


def covered_share(lights: Sequence[PlannedLight], camera: Camera) -> float:
    """How many times the volumes of a sample's points cover the image, about: boxes around spheres, discs for them."""
    points = np.array([planned.points for planned in lights])
    reach = np.array([planned.reach for planned in lights])
    distant = np.isinf(reach)
    positions = np.array([planned.light.position for planned in lights]).reshape(-1, 3)[~distant]
    reach = reach[~distant, None]
    centre = transform_points(camera.camera_from_world, positions)
    depth = -centre[:, 2:]
    nearest = depth - reach if camera.projection == "perspective" else np.ones_like(depth)
    around = (np.linalg.norm(centre, axis=1, keepdims=True) <= reach) | (nearest <= 0.0)
    left, right, bottom, top = camera.window
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (centre[:, :2] - reach) / nearest, (centre[:, :2] + reach) / nearest
    sides = np.minimum(high, [right, top]) - np.maximum(low, [left, bottom])
    shares = np.pi / 4 * np.prod(np.maximum(sides, 0.0) / [right - left, top - bottom], axis=1)
    seen = depth[:, 0] + reach[:, 0] > 0.0
    shares = np.where(around[:, 0], 1.0, np.minimum(shares, 1.0)) * points[~distant]
    return float(points[distant].sum() + shares[seen].sum())
