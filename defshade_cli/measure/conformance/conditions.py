"""A Case's conditions put on the stage's Scene: the reference's camera, light and materials in place of the stage's."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from defshade_cli.measure.conformance.catalogue import Conditions, Rectangle
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.light import DistantLight
from defshade_cli.scene.material import UNBOUND
from defshade_cli.scene.scene import Scene
from defshade_cli.spaces import Matrix, Window, conform_window, normalize

Vector = NDArray[np.float64]

_HALF_HEIGHT = math.tan(math.radians(30.0))
_WORLD_FROM_TURNED: Matrix = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], np.float64)
_TOWARDS_LIGHT = np.array([0.0, -0.5, 0.5])
_MATTE = replace(UNBOUND, use_specular_workflow=True, roughness=1.0)


def under(conditions: Conditions, scene: Scene, extent: NDArray[np.float64]) -> Scene:
    """The scene as the reference saw it. extent: (2, 3) the box that the drawing test frames."""
    if conditions.conform is not None:
        scene = replace(scene, conform=conditions.conform)
    if conditions.background is None:
        return scene
    translation = _translation(conditions, scene, extent)
    if translation is not None:
        scene = replace(scene, camera=_looking(translation, scene.up_axis))
    if conditions.lighting == "distant":
        authored = tuple(light for light in scene.lights if not light.path.startswith("<"))
        scene = replace(scene, lights=(*authored, _distant(conditions, translation)))
    return replace(scene, camera=_camera(conditions, scene), pixel_aspect=1.0)


def with_bare(conditions: Conditions, scene: Scene) -> Scene:
    """The scene with what has no material as the reference's renderer shades it: matte."""
    if conditions.bare is None:
        return scene
    bare, unauthored = np.float32(conditions.bare), np.array(UNBOUND.diffuse_color, np.float32)
    colors = [d.display_color for d in scene.drawables]
    colors = [np.where((color == unauthored).all(axis=1, keepdims=True), bare, color) for color in colors]
    drawables = (replace(d, display_color=color) for d, color in zip(scene.drawables, colors, strict=True))
    materials = tuple(_MATTE if material.path == UNBOUND.path else material for material in scene.materials)
    return replace(scene, drawables=tuple(drawables), materials=materials)


def _translation(conditions: Conditions, scene: Scene, extent: NDArray[np.float64]) -> Vector | None:
    """What the drawing test moves the stage by. Where Z is up it gives the depth of the box's centre the wrong sign."""
    if conditions.translate != "frame":
        return None if conditions.translate is None else np.array(conditions.translate)
    x, y, z = extent.mean(axis=0)
    diagonal = float(np.linalg.norm(extent[1] - extent[0]))
    return np.array([-x, -z, -y - diagonal] if scene.up_axis == "Z" else [-x, -y, -z - diagonal])


def _looking(translation: Vector, up_axis: str) -> Camera:
    """The drawing test's camera, 60° high: at the origin of a stage that is turned so that Y is up, then translated."""
    frame = np.eye(4)
    frame[:3, 3] = -translation
    window = (-_HALF_HEIGHT, _HALF_HEIGHT, -_HALF_HEIGHT, _HALF_HEIGHT)
    world_from_camera = _WORLD_FROM_TURNED @ frame if up_axis == "Z" else frame
    return Camera("<reference>", world_from_camera, window, clipping_range=(1.0, 100_000.0))


def _camera(conditions: Conditions, scene: Scene) -> Camera:
    """The scene's, cropped and cut as the reference's is.

    Storm draws prims without a material as displayColor · N·L. Where there are no others, exposure takes Lambert's
    1/π back.
    """
    assert conditions.size is not None
    aspect = conditions.size[0] / conditions.size[1]
    window = _cropped(conform_window(scene.camera.window, aspect, scene.conform), conditions.crop)
    planes = np.concatenate([scene.camera.clipping_planes, np.reshape(conditions.clip_planes, (-1, 4))])
    bare = all(material.path == UNBOUND.path for material in scene.materials)
    exposure = math.pi if bare else 1.0
    return replace(scene.camera, window=window, exposure=exposure, f_stop=0.0, clipping_planes=planes)


def _cropped(window: Window, crop: Rectangle) -> Window:
    left, right, bottom, top = window
    x0, y0, x1, y1 = crop
    width, height = right - left, top - bottom
    return left + x0 * width, left + x1 * width, top - y1 * height, top - y0 * height


def _distant(conditions: Conditions, translation: Vector | None) -> DistantLight:
    """White, of irradiance 1, from one point of the sky: for `-camlight` the translation, its last two swapped."""
    towards = translation[[0, 2, 1]] if conditions.camera_light and translation is not None else _TOWARDS_LIGHT
    back = normalize(towards)
    right = normalize(np.cross((0.0, 1.0, 0.0) if abs(back[1]) < 0.9 else (1.0, 0.0, 0.0), back))
    frame: Matrix = np.eye(4)
    frame[:3, :3] = np.column_stack([right, np.cross(back, right), back])
    return DistantLight(
        path="<reference>", world_from_light=frame, color=np.ones(3), normalize=True, angle=0.0, casts_shadow=False
    )
