"""Where the shadows of what moved may fall: boxes around all geometry that lights see through it.

Of a light and a ball around something that moved, a cone holds all that some point of the light may see behind the
ball, and between them. The boxes of geometry that meet such a cone are halved until they look small.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from defshade_cli.plan.bounds import LightBounds
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.geometry import box_corners
from defshade_cli.scene.light import Light
from defshade_cli.scene.scene import Scene
from defshade_cli.spaces import transform_points

_TEXELS, _WIDEST = 5.0, 2.0 * math.tan(math.radians(60.0)) + 0.1
"""Of a shadow map, around a place: what a look-up there depends on. Across a map, in units of the distance ahead."""
_STEPS, _MOST_BOXES, _MOST_CONES = 40, 2**12, 64
_LEAST_ANGLE = 1e-3
"""Of a cone for a light that is far away, radians."""


Caster = tuple[Light, float]
"""A light, and its `spread` as far as it is seen: none of one that is seen as a point."""

Balls = tuple[NDArray[np.float64], NDArray[np.float64]]
"""(N, 3) centres and (N,) radii."""


def shadowed_boxes(
    scene: Scene, lights: Sequence[Caster], resolution: int, moved: Balls, side: float
) -> NDArray[np.float64] | None:
    """(C, 2, 3) world space; None where they are too many.

    lights: that have shadows.  resolution: texels along the side of a map.  moved: around what casts them.
    side: of what is small enough one unit ahead of the camera, or in scene units without perspective.
    """
    if len(moved[1]) * len(lights) > _MOST_CONES:
        moved = _joined(moved)
    cones = _cones(lights, moved, resolution, scene.bounds)
    boxes = scene.drawable_bounds[np.isfinite(scene.drawable_bounds).all(axis=(1, 2))]
    found, count = [boxes[:0]], 0
    for _ in range(_STEPS):
        boxes = boxes[_meet(cones, boxes)]
        boxes = boxes[_may_be_seen(boxes, scene.camera)]
        small = _is_small(boxes, scene.camera, side)
        found.append(boxes[small])
        count += int(small.sum())
        if small.all():
            return np.concatenate(found)
        if count + len(boxes) > _MOST_BOXES + len(scene.drawables):
            break
        boxes = _halved(boxes[~small])
    return None


def _joined(balls: Balls) -> Balls:
    """One around all."""
    centres, radii = balls
    centre = 0.5 * (centres.min(axis=0) + centres.max(axis=0))
    return centre[None], np.array([(np.linalg.norm(centres - centre, axis=1) + radii).max(initial=0.0)])


def _cones(lights: Sequence[Caster], moved: Balls, resolution: int, around: NDArray[np.float64]) -> LightBounds:
    """One for each light and each of the balls. around: (2, 3), all geometry."""
    texels, extent = _TEXELS / resolution, float(np.linalg.norm(around[1] - around[0]))
    cones = [
        _distant_cone(light, spread, centre, radius, texels, extent)
        if light.is_infinite
        else _near_cone(light, spread, centre, radius, texels)
        for light, spread in lights
        for centre, radius in zip(moved[0], moved[1].tolist(), strict=True)
    ]
    apex, axis, angle = (np.array(column) for column in zip(*cones, strict=True))
    return LightBounds(apex, np.linalg.norm(np.abs(around[:, None] - apex).max(axis=0), axis=1), axis, angle)


_Cone = tuple[NDArray[np.float64], NDArray[np.float64], float]
"""Apex, axis, and the angle between axis and mantle."""


def _near_cone(light: Light, spread: float, centre: NDArray[np.float64], radius: float, texels: float) -> _Cone:
    """Behind the light, so that it holds the light and spreads as the rays past both do; no cone where they meet."""
    offset = centre - light.position
    distance = float(np.linalg.norm(offset))
    both = spread + radius + texels * _WIDEST * distance
    if both >= 0.9 * distance:
        return light.position, light.axis, math.pi
    axis = offset / distance
    return light.position - axis * (spread * distance / both), axis, math.asin(both / distance)


def _distant_cone(
    light: Light, spread: float, centre: NDArray[np.float64], radius: float, texels: float, extent: float
) -> _Cone:
    """So far behind that it is wide enough wherever geometry, which is `extent` across, is before the ball."""
    angle = max(math.asin(min(spread, 1.0)), _LEAST_ANGLE)
    behind = 2.0 * extent + (radius + 1.5 * texels * extent) / math.sin(angle)
    return centre - light.axis * behind, light.axis, angle if angle < math.pi / 3 else math.pi


def _meet(cones: LightBounds, boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(B,) does any of the cones meet each box?"""
    cone, box = (each.ravel() for each in np.indices((len(cones), len(boxes))))
    met = cones.meet(cone, boxes[box]).reshape(len(cones), len(boxes))
    return np.asarray(met.any(axis=0))


def _may_be_seen(boxes: NDArray[np.float64], camera: Camera) -> NDArray[np.bool_]:
    """(B,) False for those that lie wholly beyond a side of the view, from wherever on the lens."""
    x, y, z = np.moveaxis(transform_points(camera.camera_from_world, box_corners(boxes)), -1, 0)
    ahead = -z if camera.projection == "perspective" else np.ones_like(z)
    left, right, bottom, top = camera.window
    lens = camera.lens_radius * (1.0 + np.abs(ahead) / (camera.focus_distance or math.inf))
    room = 0.05 * max(right - left, top - bottom) * np.abs(ahead) + lens
    sides = np.stack([x - left * ahead, right * ahead - x, y - bottom * ahead, top * ahead - y])
    return np.asarray((sides >= -room).any(axis=2).all(axis=0))


def _is_small(boxes: NDArray[np.float64], camera: Camera, side: float) -> NDArray[np.bool_]:
    """(B,) do they look small?"""
    apart = np.maximum(np.maximum(boxes[:, 0] - camera.position, camera.position - boxes[:, 1]), 0.0)
    ahead = np.linalg.norm(apart, axis=1) if camera.projection == "perspective" else np.ones(len(boxes))
    return np.asarray(np.ptp(boxes, axis=1).max(axis=1) <= side * ahead)


def _halved(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2 B, 2, 3) across their longest sides."""
    rows, axis = np.arange(len(boxes)), np.ptp(boxes, axis=1).argmax(axis=1)
    low, high = boxes.copy(), boxes.copy()
    low[rows, 1, axis] = high[rows, 0, axis] = boxes[rows, :, axis].mean(axis=1)
    return np.concatenate([low, high])
