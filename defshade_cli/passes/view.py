"""The camera as the GPU sees it: one View record a sample."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.records import record
from defshade_cli.passes.planes import uses_standard_depth
from defshade_cli.plan import Plan
from defshade_cli.scene.camera import Camera
from defshade_cli.settings import Layout
from defshade_cli.spaces import Matrix, Window


def view_record(plan: Plan, layout: Layout, jitter: tuple[float, float] = (0.5, 0.5), sample: int = 0) -> NDArray:
    """(1,) View; `jitter` is the sample's place in its pixel, (0.5, 0.5) for the centre."""
    camera, standard = plan.camera, uses_standard_depth(layout)
    window = _jittered(camera.window, plan.size, jitter)
    view = np.zeros(1, record("View"))
    rotation = np.eye(4)
    rotation[:3, :3] = camera.world_from_camera[:3, :3]
    view["clip_from_relative"] = (clip_from_camera(camera, window, plan.clip, standard) @ rotation.T).T
    view["relative_from_camera"] = rotation.T
    view["window"] = window
    view["depth_coefficients"] = depth_coefficients(camera, plan.clip, standard)
    view["size"] = plan.size
    view["exposure"] = plan.exposure
    view["sample_index"] = sample
    return view


def clip_from_camera(camera: Camera, window: Window, clip: tuple[float, float], standard: bool) -> Matrix:
    """Projection to depth [0, 1]: 1 at the near plane (reversed), or 0 there in the `standard` sense."""
    left, right, bottom, top = window
    near, far = clip
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[1, 1] = 2.0 / (right - left), 2.0 / (top - bottom)
    centre_x, centre_y = (right + left) / (right - left), (top + bottom) / (top - bottom)
    if camera.projection == "perspective":
        matrix[0, 2], matrix[1, 2], matrix[3, 2] = centre_x, centre_y, -1.0
        matrix[2, 2:] = (near / (far - near), near * far / (far - near))
    else:
        matrix[0, 3], matrix[1, 3], matrix[3, 3] = -centre_x, -centre_y, 1.0
        matrix[2, 2:] = (1.0 / (far - near), far / (far - near))
    if standard:
        matrix[2] = matrix[3] - matrix[2]
    return matrix


def depth_coefficients(camera: Camera, clip: tuple[float, float], standard: bool) -> tuple[float, float]:
    """(x, y) with x · stored + y = 1/z (perspective) or z (orthographic) for planar camera depth z."""
    near, far = clip
    at_far, at_near = (1.0 / far, 1.0 / near) if camera.projection == "perspective" else (far, near)
    return (at_far - at_near, at_near) if standard else (at_near - at_far, at_far)


def camera_depth(camera: Camera, clip: tuple[float, float], standard: bool, stored: NDArray) -> NDArray[np.float64]:
    """Planar depth (scene units) of stored values, +inf where nothing was drawn."""
    scale, offset = depth_coefficients(camera, clip, standard)
    linear = scale * stored.astype(np.float64) + offset
    depth = 1.0 / linear if camera.projection == "perspective" else linear
    return np.where(stored == (1.0 if standard else 0.0), np.inf, depth)


def _jittered(window: Window, size: tuple[int, int], jitter: tuple[float, float]) -> Window:
    """The window moved so that every pixel's centre falls on the sample's place; raster y points down."""
    left, right, bottom, top = window
    dx = (jitter[0] - 0.5) * (right - left) / size[0]
    dy = (0.5 - jitter[1]) * (top - bottom) / size[1]
    return left + dx, right + dx, bottom + dy, top + dy
