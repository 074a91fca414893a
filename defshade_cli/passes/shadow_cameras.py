"""The cameras of shadow maps: what a light's maps must see.

A light that has all geometry in front of it gets one map, fitted to the geometry or to its cone; a light amid it gets
the six faces of a cube.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.camera import Camera, Projection
from defshade_cli.scene.emission import Emitter
from defshade_cli.scene.shaping import Shaping
from defshade_cli.spaces import Matrix, Window, frame_along, transform_points

_WIDEST_DEGREES = 60.0
_NO_WINDOW: Window = (-1.0, 1.0, -1.0, 1.0)
_NEAREST = 1e-4  # near plane over far plane, where nothing else bounds it
_LEAST = 1e-20  # where what is lit lies at the light itself, to float64's digits


@dataclass(frozen=True, slots=True, eq=False)
class ShadowExtent:
    """What the maps must see, as boxes of eight corners (8, 3) relative to the eye.

    receivers: around what the image may show; casters: around all geometry.
    resolution: texels along a side of each map.
    """

    receivers: NDArray[np.float64]
    casters: NDArray[np.float64]
    resolution: int

    @property
    def margin(self) -> float:
        """Of a map's side: room for the jitter and for the texels around a receiver."""
        return 4.0 / self.resolution


def shadow_cameras(
    emitter: Emitter, shaping: Shaping | None, extent: ShadowExtent, *, distant: bool
) -> tuple[Camera, ...]:
    """The maps' cameras: one, or the six of a cube in the shader's order; the emitter is relative to the eye."""
    if distant:
        return (_parallel(emitter.axis, extent),)
    far = float(np.linalg.norm(extent.receivers - emitter.position, axis=1).max()) * 1.001 + _LEAST
    fitted = [_around_cone(emitter, shaping, far, extent.margin), _around_receivers(emitter.position, extent, far)]
    cameras = [camera for camera in fitted if camera is not None]
    return (min(cameras, key=_opening),) if cameras else _cube(emitter.position, far, extent.margin)


def _parallel(axis: NDArray[np.float64], extent: ShadowExtent) -> Camera:
    centre = extent.receivers.mean(axis=0)
    camera_from_world = _looking(centre, axis, _NO_WINDOW, (0, 0)).camera_from_world
    seen = transform_points(camera_from_world, extent.receivers)
    depth = -transform_points(camera_from_world, np.concatenate([extent.receivers, extent.casters]))[:, 2]
    margin = extent.margin * float(np.ptp(seen, axis=0).max()) + 1e-12 * max(1.0, float(np.abs(depth).max()))
    low, high = seen.min(axis=0) - margin, seen.max(axis=0) + margin
    clip = (depth.min() - margin, depth.max() + margin)
    return _looking(centre, axis, (low[0], high[0], low[1], high[1]), clip, "orthographic")


def _around_cone(emitter: Emitter, shaping: Shaping | None, far: float, margin: float) -> Camera | None:
    if shaping is None or shaping.cone_angle > _WIDEST_DEGREES:
        return None
    side = math.tan(math.radians(max(shaping.cone_angle, 0.01))) * (1.0 + margin)
    return _looking(emitter.position, emitter.axis, (-side, side, -side, side), (_NEAREST * far, far))


def _around_receivers(position: NDArray[np.float64], extent: ShadowExtent, far: float) -> Camera | None:
    """A map that sees all receivers; None where that is too wide, or the position is amid them."""
    direction = extent.receivers.mean(axis=0) - position
    if not direction.any():
        return None
    camera_from_world = _looking(position, direction, _NO_WINDOW, (0, 0)).camera_from_world
    seen = transform_points(camera_from_world, extent.receivers)
    depth = -seen[:, 2:]
    if depth.min() <= _NEAREST * depth.max():
        return None
    low, high = (seen[:, :2] / depth).min(axis=0), (seen[:, :2] / depth).max(axis=0)
    if max(np.abs(low).max(), np.abs(high).max()) > math.tan(math.radians(_WIDEST_DEGREES)):
        return None
    margin = extent.margin * (high - low) + 1e-9
    (left, bottom), (right, top) = low - margin, high + margin
    casters = -transform_points(camera_from_world, extent.casters)[:, 2]
    near = max(0.999 * float(min(casters.min(), depth.min())), _NEAREST * far)
    return _looking(position, direction, (left, right, bottom, top), (near, far))


def _cube(position: NDArray[np.float64], far: float, margin: float) -> tuple[Camera, ...]:
    side = 1.0 + margin  # so that the faces still meet
    window = (-side, side, -side, side)
    return tuple(_framed(position, frame, window, (_NEAREST * far, far)) for frame in _FACE_FRAMES)


def _face_frame(axis: int, sign: float) -> NDArray[np.float64]:
    """(3, 3) of the camera that looks along an axis: right, up and back; the other two axes are its sides.

    shaders/lib/shadow.glsl finds a direction's place in a face by the same rule.
    """
    unit = np.eye(3)
    return np.column_stack([-sign * unit[(axis + 1) % 3], unit[(axis + 2) % 3], -sign * unit[axis]])


_FACE_FRAMES = tuple(_face_frame(axis, sign) for axis in range(3) for sign in (1.0, -1.0))


def _opening(camera: Camera) -> float:
    left, right, bottom, top = camera.window
    return (right - left) * (top - bottom)


def _looking(
    position: NDArray[np.float64],
    direction: NDArray[np.float64],
    window: Window,
    clip: tuple[float, float],
    projection: Projection = "perspective",
) -> Camera:
    return _framed(position, frame_along(-np.asarray(direction)), window, clip, projection)


def _framed(
    position: NDArray[np.float64],
    rotation: NDArray[np.float64],
    window: Window,
    clip: tuple[float, float],
    projection: Projection = "perspective",
) -> Camera:
    frame: Matrix = np.eye(4)
    frame[:3, :3] = rotation
    frame[:3, 3] = position
    return Camera("<shadow>", frame, window, projection, clip)
