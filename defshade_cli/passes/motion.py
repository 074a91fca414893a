"""How every instance is seen one frame earlier, now, and one frame later."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.records import record
from defshade_cli.passes.view import clip_from_camera
from defshade_cli.plan import Plan
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.scene import Scene


def motion_records(scene: Scene, plan: Plan) -> NDArray[Any]:
    """One Motion record a placement (P,), in the drawables' order; products taken in float64."""
    seen = [_seen(plan.camera, [d.world_from_object for d in scene.drawables], plan)] * 3
    for number, moment in zip((0, 2), scene.neighbours, strict=False):
        seen[number] = _seen(_framed(moment.camera, scene, plan), moment.placements, plan)
    records = np.zeros(len(seen[0]), record("Motion"))
    for name, matrices in zip(records.dtype.names or (), seen, strict=True):
        records[name] = matrices.transpose(0, 2, 1)
    return records


def neighbouring_points(scene: Scene) -> Iterator[NDArray[np.float32]]:
    """(V, 3) points of all meshes one frame earlier, and one later; as now where no neighbours were read."""
    now = tuple(mesh.points for mesh in scene.meshes)
    for points in [moment.points for moment in scene.neighbours] or [now, now]:
        yield np.concatenate([np.empty((0, 3), np.float32), *points])


def _seen(camera: Camera, placements: Sequence[NDArray[np.float64]], plan: Plan) -> NDArray[np.float64]:
    """(N, 4, 4) clip_from_object of all placements."""
    clip_from_world = clip_from_camera(camera, camera.window, plan.clip, standard=False) @ camera.camera_from_world
    return clip_from_world @ np.concatenate([np.empty((0, 4, 4)), *placements])


def _framed(camera: Camera, scene: Scene, plan: Plan) -> Camera:
    """The camera with the window that the plan's own has of the same image."""
    conformed = camera.conformed(plan.display_camera.aspect, scene.conform)
    return replace(conformed, window=plan.window.of(conformed.window, plan.display))
