"""The camera as the GPU sees it: one View record a sample."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.planes import uses_standard_depth
from defshade_cli.gpu.records import record
from defshade_cli.passes.sampling import CENTRE, Sample
from defshade_cli.plan import Plan
from defshade_cli.scene.camera import Camera
from defshade_cli.settings import Layout
from defshade_cli.spaces import Matrix, Window, inverse_rigid, rigid


def view_record(plan: Plan, layout: Layout, sample: Sample = CENTRE) -> NDArray[Any]:
    """(1,) View of one sample: its place in the pixel moves the window, its place on the lens the eye."""
    camera, standard = plan.camera, uses_standard_depth(layout)
    window, relative_from_camera = seen_window(plan, sample), placement(camera, sample)
    view = np.zeros(1, record("View"))
    clip_from_relative = clip_from_camera(camera, window, plan.clip, standard) @ inverse_rigid(relative_from_camera)
    view["clip_from_relative"] = clip_from_relative.T
    view["relative_from_camera"] = relative_from_camera.T
    view["first"], view["right"], view["down"] = _rays(relative_from_camera, window, plan)
    view["depth_coefficients"] = depth_coefficients(camera, plan.clip, standard)
    view["size"], view["origin"] = plan.size, plan.window.origin
    view["exposure"] = plan.exposure
    view["sample_index"] = sample.index
    view["sky_share"] = plan.sky_share
    view["lobe_rays"] = plan.lobe_rays * plan.samples
    view["roughest_rays"] = plan.roughest_rays
    view["cell"] = sample.cell
    return view


def placement(camera: Camera, sample: Sample) -> Matrix:
    """(4, 4) relative from camera space: the eye at the sample's place on the lens."""
    matrix = rigid(camera.world_from_camera)
    matrix[:3, 3] = matrix[:3, :3] @ lens_offset(camera, sample.lens)
    return matrix


def seen_window(plan: Plan, sample: Sample) -> Window:
    """What the sample's eye sees: moved with its place in the pixel, and sheared so that the plane of focus stays."""
    lens, (left, right, bottom, top) = lens_offset(plan.camera, sample.lens), plan.camera.window
    dx, dy = lens[:2] / plan.camera.focus_distance if lens.any() else (0.0, 0.0)
    dx -= (sample.pixel[0] - 0.5) * (right - left) / plan.size[0]
    dy -= (0.5 - sample.pixel[1]) * (top - bottom) / plan.size[1]
    return left - dx, right - dx, bottom - dy, top - dy


def _rays(relative_from_camera: Matrix, window: Window, plan: Plan) -> Matrix:
    """(3, 3): from the eye to the top left, one unit ahead in perspective; and from pixel to pixel, right and down."""
    (left, right, bottom, top), (width, height) = window, plan.size
    ahead = -1.0 if plan.camera.projection == "perspective" else 0.0
    rays = [[left, top, ahead], [(right - left) / width, 0.0, 0.0], [0.0, (bottom - top) / height, 0.0]]
    matrix: Matrix = np.array(rays) @ relative_from_camera[:3, :3].T
    return matrix


def lens_offset(camera: Camera, u: tuple[float, float]) -> NDArray[np.float64]:
    """(3,) place on the thin lens in camera space, scene units: a disk of diameter focal length / f-stop.

    Zero for a pinhole, an orthographic camera, or one without a focus distance.
    Square to disk: Shirley & Chiu 1997, "A Low Distortion Map Between Disk and Square".
    """
    a, b = 2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0
    radius = camera.lens_radius
    if radius == 0.0 or a == b == 0.0:
        return np.zeros(3)
    r, angle = (a, math.pi / 4 * b / a) if abs(a) > abs(b) else (b, math.pi / 2 - math.pi / 4 * a / b)
    return radius * r * np.array([math.cos(angle), math.sin(angle), 0.0])


def clip_from_camera(camera: Camera, window: Window, clip: tuple[float, float], standard: bool) -> Matrix:
    """Projection (4, 4) to depth [0, 1]: 1 at the near plane (reversed), or 0 there in the `standard` sense."""
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


def camera_depth(
    camera: Camera, clip: tuple[float, float], standard: bool, stored: NDArray[Any]
) -> NDArray[np.float64]:
    """Planar depth (scene units) of stored values (H, W), +inf where nothing was drawn."""
    scale, offset = depth_coefficients(camera, clip, standard)
    linear = scale * stored.astype(np.float64) + offset
    depth = 1.0 / linear if camera.projection == "perspective" else linear
    return np.where(stored == (1.0 if standard else 0.0), np.inf, depth)
