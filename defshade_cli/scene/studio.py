"""A studio for assets that bring no light: key, fill and rim softboxes, and a dome that shades from bright to dark.

It turns with the camera, as if the asset turned in front of it, and grows with what it lights.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.environment import Environment
from defshade_cli.scene.framing import rotation, world_from_front
from defshade_cli.scene.light import DomeLight, Light, RectLight
from defshade_cli.scene.scene import Scene
from defshade_cli.spaces import Matrix, translation

_SKY, _HORIZON, _GROUND = 0.7, 0.42, 0.07
"""Radiance of the dome."""

_ROWS = 1024  # of its image: fewer are seen as bands


@dataclass(frozen=True, slots=True)
class _Softbox:
    """azimuth, elevation: degrees, seen from the asset, the camera's side being 0.

    size: (width, height), distance: in radii of the asset.  irradiance: at the asset's centre, facing the light.
    color: linear Rec. 709.
    """

    name: str
    azimuth: float
    elevation: float
    size: tuple[float, float]
    distance: float
    irradiance: float
    color: tuple[float, float, float]


_SOFTBOXES = (
    _Softbox("key", -42.0, 38.0, (2.4, 2.4), 5.0, 3.2, (1.0, 0.97, 0.93)),
    _Softbox("fill", 55.0, 12.0, (3.0, 4.0), 6.0, 0.7, (0.92, 0.96, 1.0)),
    _Softbox("rim", 158.0, 42.0, (3.0, 1.2), 5.0, 4.0, (1.0, 1.0, 1.0)),
)


def studio_lights(scene: Scene) -> tuple[Light, ...]:
    """The studio around all that is drawn, as the scene's camera sees it."""
    box = scene.bounds if np.isfinite(scene.bounds).all() else np.array([[-0.5] * 3, [0.5] * 3])
    radius = float(np.linalg.norm(box[1] - box[0])) / 2 or 1.0
    upright = world_from_front(scene.up_axis)
    back = upright[:3, :3].T @ scene.camera.world_from_camera[:3, 2]
    heading = math.degrees(math.atan2(back[0], back[2]))
    world_from_asset = translation(box.mean(axis=0)) @ upright @ rotation(heading, 0.0)
    return (_dome(upright), *(_rect(box, radius, world_from_asset) for box in _SOFTBOXES))


def _rect(box: _Softbox, radius: float, world_from_asset: Matrix) -> RectLight:
    """On its axis at distance d a small light of area A and radiance L gives the irradiance L A / d²."""
    distance, (width, height) = box.distance * radius, (side * radius for side in box.size)
    placed = rotation(box.azimuth, box.elevation) @ translation(np.array([0.0, 0.0, distance]))
    return RectLight(
        path=f"<studio {box.name}>",
        world_from_light=world_from_asset @ placed,
        color=np.array(box.color),
        intensity=box.irradiance * distance**2 / (width * height),
        width=width,
        height=height,
    )


def _dome(upright: Matrix) -> DomeLight:
    return DomeLight(path="<studio dome>", world_from_light=upright, color=np.ones(3), environment=_sky())


@cache
def _sky() -> Environment:
    """It fades from above to the horizon, and to the ground without an edge. One for all, since devices keep it."""
    height = np.cos(math.pi * (np.arange(_ROWS) + 0.5) / _ROWS)
    above, below = np.maximum(height, 0.0), np.maximum(-height, 0.0)
    radiance = _HORIZON + (_SKY - _HORIZON) * above + (_GROUND - _HORIZON) * (below * below * (3.0 - 2.0 * below))
    return Environment(np.broadcast_to(radiance[:, None, None], (_ROWS, 4, 3)).astype(np.float32))
