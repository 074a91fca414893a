"""Whether lights are drawn as blended volumes or by tiles: what is cheaper, by the share of the image that they cover.

A volume reads the GBuffer and blends for each pixel that it covers; tiles do so once a pixel, whatever the lights, but
bin them first.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from defshade_cli.plan.lights import PlannedLight
from defshade_cli.scene.camera import Camera
from defshade_cli.settings import Lighting, RenderSettings
from defshade_cli.spaces import transform_points

VOLUME, PIXEL, LIGHT = 44.0, 25.0, 14.0
"""ns: of a volume a covered pixel; of tiles a pixel, and a light there. llvmpipe, the float layout."""


def choose_lighting(
    lights: Sequence[PlannedLight], camera: Camera, settings: RenderSettings, layers: Sequence[str]
) -> Lighting:
    """`volumes` or `tiles`. The layer lightComplexity counts volumes, so it has them where nothing is asked."""
    if settings.lighting != "auto":
        return settings.lighting
    if "lightComplexity" in layers:
        return "volumes"
    covered = covered_share(lights, camera)
    return "tiles" if VOLUME * covered > PIXEL + LIGHT * covered else "volumes"


def covered_share(lights: Sequence[PlannedLight], camera: Camera) -> float:
    """How many times the lights' volumes cover the image, about: boxes around spheres, discs for them."""
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
    return float(distant.sum() + np.where(around[:, 0], 1.0, np.minimum(shares, 1.0))[seen].sum())
