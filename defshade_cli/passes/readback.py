"""GBuffer planes and radiance as named layers in NumPy."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.planes import Plane, uses_standard_depth
from defshade_cli.image.layers import LAYERS, PRIMVAR_FAMILY, Layer
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.identification import id_values
from defshade_cli.passes.view import camera_depth
from defshade_cli.plan import Plan
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.identity import Identities
from defshade_cli.scene.scene import Scene
from defshade_cli.spaces import transform_directions, transform_points

log = logging.getLogger("defshade")

Planes = dict[str, NDArray[Any]]


def read_planes(gbuffer: GBuffer, wanted: Iterable[Plane], plan: Plan) -> Planes:
    """(height, width, components) a plane of a float GBuffer, and "depth": planar, +inf on the background."""
    planes: Planes = {plane.name: gbuffer.target.read(plane.name) for plane in wanted}
    stored = gbuffer.target.read_depth()
    depth = camera_depth(plan.camera, plan.clip, uses_standard_depth(gbuffer.layout), stored)
    planes["depth"] = depth.astype(np.float32)[..., None]
    return planes


def data_layers(planes: Planes, plan: Plan, scene: Scene) -> dict[str, NDArray[np.float32]]:
    """The data layers (H, W, C) that the plan asks for, background filled in."""
    covered, identities = np.isfinite(planes["depth"]), Identities(scene)
    layers = {}
    for name in plan.data_layers:
        layer = LAYERS[name]
        if layer.source == "visible":
            values: NDArray[Any] = id_values(name, planes["visible"], identities)
        elif layer.source == "primvar":
            values = _primvar_values(name.removeprefix(PRIMVAR_FAMILY), planes, plan, scene)
        else:
            values = _layer_values(layer, planes, plan.camera)
        layers[name] = np.where(covered, values, np.float32(layer.background)).astype(np.float32)
    return layers


def _primvar_values(name: str, planes: Planes, plan: Plan, scene: Scene) -> NDArray[Any]:
    """As many numbers as the primvar has where it has most; one where no prim has it."""
    widths = [mesh.primvars[name].shape[1] for mesh in scene.meshes if name in mesh.primvars]
    if not widths:
        log.warning("%s%s: no prim has such a primvar", PRIMVAR_FAMILY, name)
    return planes[f"primvar_{plan.primvars.index(name)}"][..., : max(widths, default=1)]


def _layer_values(layer: Layer, planes: Planes, camera: Camera) -> NDArray[Any]:
    match layer.name:
        case "distance":
            return np.linalg.norm(camera_positions(planes["depth"], camera), axis=-1, keepdims=True)
        case "position":
            return transform_points(camera.world_from_camera, camera_positions(planes["depth"], camera))
        case "Peye":
            return camera_positions(planes["depth"], camera)
        case "Neye":
            return transform_directions(camera.camera_from_world, planes["normal"][..., :3])
        case _:
            return planes[layer.source][..., layer.first : layer.first + len(layer.channels)]


def camera_positions(depth: NDArray[np.float32], camera: Camera) -> NDArray[np.float64]:
    """(height, width, 3) camera-space points at the pixels' centres; 0 on the background."""
    height, width = depth.shape[:2]
    left, right, bottom, top = camera.window
    x = left + (right - left) * (np.arange(width) + 0.5) / width
    y = top + (bottom - top) * (np.arange(height) + 0.5) / height
    z = np.where(np.isfinite(depth), depth, 0.0).astype(np.float64)[..., 0]
    scale = z if camera.projection == "perspective" else np.ones_like(z)
    return np.stack([x[None, :] * scale, y[:, None] * scale, -z], axis=-1)
