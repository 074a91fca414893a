"""Cameras of ours around what is to be seen.

The front is +Z where Y is up, and −Y where Z is up. From there an azimuth turns towards +X, and an elevation rises.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.geometry import box_corners
from defshade_cli.spaces import Matrix, Window, translation

THREE_QUARTER = (30.0, 20.0)
"""(azimuth, elevation) in degrees: the view of an object that shows most of it."""

_Z_UP_FROM_FRONT = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], np.float64)
_MARGIN = 1.06  # of the image around what is in it
_CIRCLE = 64  # directions from which a turn is fitted


@dataclass(frozen=True, slots=True)
class Framing:
    """What a camera of ours looks at, and from where.

    direction: (azimuth, elevation) in degrees of the camera as seen from what it looks at.
    turn: frames in which it goes around once, the first of them being frame 1; None for a camera that stands.
    """

    direction: tuple[float, float] = THREE_QUARTER
    turn: int | None = None

    @property
    def name(self) -> str:
        """What file names and headers call the camera."""
        return "turntable" if self.turn else "fit"

    def camera(self, bounds: NDArray[np.float64], up_axis: str, window: Window, frame: float | None) -> Camera:
        """A camera with `window`, around its axis, that has the whole box (2, 3) in view, with a margin.

        On a turn it keeps the distance that fits the box from all around.
        """
        box = bounds if np.isfinite(bounds).all() else np.array([[-0.5] * 3, [0.5] * 3])
        azimuth, elevation = self.direction
        around = world_from_front(up_axis) @ rotation(azimuth + self._turned(frame), elevation)
        points = (box_corners(box) - box.mean(axis=0)) @ around[:3, :3]
        seen = _swept(points @ rotation(0.0, elevation)[:3, :3].T, elevation) if self.turn else points
        distance = _fitting_distance(seen, window)
        world_from_camera = translation(box.mean(axis=0)) @ around @ translation(np.array([0.0, 0.0, distance]))
        near, far = (distance - seen[:, 2].max()) / 4, 2 * (distance - seen[:, 2].min())
        return Camera(f"<{self.name}>", world_from_camera, window, clipping_range=(near, far))

    def _turned(self, frame: float | None) -> float:
        """Degrees that the camera has gone by `frame`."""
        return 0.0 if self.turn is None or frame is None else 360.0 * (frame - 1.0) / self.turn


@dataclass(frozen=True, slots=True)
class Held:
    """A camera that is given, whatever is in view."""

    held: Camera
    turn: int | None = None

    @property
    def name(self) -> str:
        """What file names and headers call the camera."""
        return "held"

    def camera(self, bounds: NDArray[np.float64], up_axis: str, window: Window, frame: float | None) -> Camera:
        """The camera as it is, whatever is in view. bounds: (2, 3), unused."""
        return self.held


def world_from_front(up_axis: str) -> Matrix:
    """(4, 4) the world seen from its front: +X right, +Y up, +Z towards the eye."""
    return _Z_UP_FROM_FRONT if up_axis == "Z" else np.eye(4)


def rotation(azimuth: float, elevation: float) -> Matrix:
    """(4, 4) front_from_camera for a camera at these degrees."""
    a, e = math.radians(azimuth), math.radians(elevation)
    turned = np.array([[math.cos(a), 0, math.sin(a)], [0, 1, 0], [-math.sin(a), 0, math.cos(a)]])
    raised = np.array([[1, 0, 0], [0, math.cos(e), math.sin(e)], [0, -math.sin(e), math.cos(e)]])
    matrix = np.eye(4)
    matrix[:3, :3] = turned @ raised
    return matrix


def _swept(points: NDArray[np.float64], elevation: float) -> NDArray[np.float64]:
    """Upright points (N, 3) around the origin, turned about +Y all around, as a camera at `elevation` has them."""
    reach = float(np.hypot(points[:, 0], points[:, 2]).max())
    angle = 2.0 * math.pi * np.arange(_CIRCLE) / _CIRCLE
    ring = reach * np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=1)
    rings = np.concatenate([ring + np.array([0.0, height, 0.0]) for height in (points[:, 1].min(), points[:, 1].max())])
    return rings @ rotation(0.0, elevation)[:3, :3]


def _fitting_distance(points: NDArray[np.float64], window: Window) -> float:
    """How far from the origin, along +Z, a camera with a window around its axis sees all points (N, 3)."""
    across = _MARGIN * np.abs(points[:, :2]) / [window[1], window[3]]
    room = 1e-3 * np.linalg.norm(points, axis=1).max() or 1.0
    return float((np.maximum(across.max(axis=1), room) + points[:, 2]).max())
