"""What lights bring to a point, in float64: what shaders/lib/light.glsl must agree with.

A light other than a distant one is its far field: `intensity_on_axis` × profile × shaping over distance².
Formulas: LightAPI and ShapingAPI in the UsdLux schema text of usd-core.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.light import DistantLight, Light
from defshade_cli.scene.shaping import Shaping
from defshade_cli.spaces import normalize

Array = NDArray[np.float64]


def irradiance_at(light: Light, positions: Array) -> tuple[Array, Array]:
    """At world-space `positions` (P, 3): unit directions to the light; the irradiance facing it, (P, 3)."""
    if isinstance(light, DistantLight):
        shape = positions.shape
        return np.broadcast_to(-light.axis, shape), np.broadcast_to(light.irradiance, shape)
    to_light = light.position - positions
    emitted = -normalize(to_light)
    falloff = _profile(light, emitted) / np.sum(np.square(to_light), axis=-1)
    irradiance = light.intensity_on_axis * falloff[..., None]
    if light.shaping is not None:
        irradiance = irradiance * shaping_factor(light.shaping, light.axis, emitted)
        irradiance = irradiance * ies_factor(light.shaping, light.frame, emitted)[..., None]
    return -emitted, irradiance


def ies_factor(shaping: Shaping, frame: Array, emitted: Array) -> Array:
    """(P,) factor of the IES profile on what leaves along unit vectors `emitted` (P, 3); 1 without a profile.

    frame: (3, 3) unit X, Y and Z of the light in its columns. As in OpenUSD's own renderer, the angles are the polar
    coordinates of the direction that light comes from: 0 vertical along the axis, 0 horizontal for light towards −X.
    """
    if shaping.ies is None:
        return np.ones(emitted.shape[:-1])
    x, y, z = np.moveaxis(-emitted @ frame, -1, 0)
    vertical = np.degrees(np.arctan2(np.hypot(x, y), z))
    scale = shaping.ies_angle_scale
    if scale > 0.0:
        vertical = vertical / scale
    elif scale < 0.0:
        vertical = (vertical - 180.0) / -scale + 180.0
    factor = shaping.ies.at(np.clip(vertical, 0.0, 180.0), np.degrees(np.arctan2(y, x)))
    return factor / shaping.ies.mean if shaping.ies_normalize else factor


def shaping_factor(shaping: Shaping, axis: Array, emitted: Array) -> Array:
    """(P, 3) factor on what leaves along unit vectors `emitted` (P, 3); `axis` (3,) is the light's −Z."""
    cosine = emitted @ axis
    sine = np.linalg.norm(np.cross(emitted, axis), axis=-1)
    cone = _cone(np.degrees(np.arctan2(sine, cosine)), shaping.cone_angle, shaping.cone_softness)
    focus = np.power(np.abs(cosine), max(shaping.focus, 0.0))[..., None]
    tint = np.asarray(shaping.focus_tint)
    return cone[..., None] * (tint + (1.0 - tint) * focus)


def _cone(theta: Array, angle: float, softness: float) -> Array:
    """1 inside, 0 outside `angle`; smoothstep over the outer `softness` of it. Degrees."""
    width = angle * min(max(softness, 0.0), 1.0)
    if width == 0.0:
        return (theta <= angle).astype(np.float64)
    t = np.clip((theta - (angle - width)) / width, 0.0, 1.0)
    return 1.0 - t * t * (3.0 - 2.0 * t)


def _profile(light: Light, emitted: Array) -> Array:
    if light.profile == "cosine":
        return np.maximum(emitted @ light.axis, 0.0)
    if light.profile == "sine":
        along = normalize(light.world_from_light[:3, 0])
        return np.linalg.norm(np.cross(emitted, along), axis=-1)
    return np.ones(emitted.shape[:-1])
