"""A Case's conditions put on the stage's Scene: the reference's camera, light and materials in place of the stage's."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from defshade_cli.measure.conformance.catalogue import Conditions, Rectangle
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.light import DistantLight
from defshade_cli.scene.material import UNBOUND
from defshade_cli.scene.scene import Scene
from defshade_cli.spaces import Matrix, Window, conform_window, normalize

_HALF_HEIGHT = math.tan(math.radians(30.0))
_Z_UP: Matrix = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], np.float64)
_MATTE = replace(UNBOUND, use_specular_workflow=True, roughness=1.0)


def under(conditions: Conditions, scene: Scene) -> Scene:
    """The scene as the reference saw it."""
    if conditions.conform is not None:
        scene = replace(scene, conform=conditions.conform)
    if conditions.background is None:
        return scene
    scene = replace(scene, camera=_camera(conditions, scene), pixel_aspect=1.0)
    if conditions.lighting == "distant":
        authored = tuple(light for light in scene.lights if not light.path.startswith("<"))
        scene = replace(scene, lights=(*authored, _distant(conditions.light)))
    materials = tuple(_MATTE if material.path == UNBOUND.path else material for material in scene.materials)
    return replace(scene, materials=materials)


def _camera(conditions: Conditions, scene: Scene) -> Camera:
    """One of ours where an eye is given; cropped, and with the reference's clipping planes.

    Storm draws prims without a material as displayColor · N·L. Where there are no others, exposure takes Lambert's
    1/π back.
    """
    camera = scene.camera if conditions.eye is None else _looking(conditions)
    assert conditions.size is not None
    aspect = conditions.size[0] / conditions.size[1]
    window = _cropped(conform_window(camera.window, aspect, scene.conform), conditions.crop)
    bare = all(material.path == UNBOUND.path for material in scene.materials)
    planes = np.concatenate([camera.clipping_planes, np.reshape(conditions.clip_planes, (-1, 4))])
    return replace(camera, window=window, exposure=math.pi if bare else 1.0, f_stop=0.0, clipping_planes=planes)


def _looking(conditions: Conditions) -> Camera:
    frame = _Z_UP.copy() if conditions.look == "+Y" else np.eye(4)
    frame[:3, 3] = conditions.eye
    window = (-_HALF_HEIGHT, _HALF_HEIGHT, -_HALF_HEIGHT, _HALF_HEIGHT)
    return Camera("<reference>", frame, window, clipping_range=(1.0, 100_000.0))


def _cropped(window: Window, crop: Rectangle) -> Window:
    left, right, bottom, top = window
    x0, y0, x1, y1 = crop
    width, height = right - left, top - bottom
    return left + x0 * width, left + x1 * width, top - y1 * height, top - y0 * height


def _distant(towards: tuple[float, float, float]) -> DistantLight:
    """White, of irradiance 1, from one point of the sky."""
    back = normalize(np.array(towards, np.float64))
    right = normalize(np.cross((0.0, 1.0, 0.0) if abs(back[1]) < 0.9 else (1.0, 0.0, 0.0), back))
    frame: Matrix = np.eye(4)
    frame[:3, :3] = np.column_stack([right, np.cross(back, right), back])
    return DistantLight(
        path="<reference>", world_from_light=frame, color=np.ones(3), normalize=True, angle=0.0, casts_shadow=False
    )
