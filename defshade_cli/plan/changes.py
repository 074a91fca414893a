"""What of a frame must be drawn anew, where the one before is known: what moved covers a part of the image.

Instances are compared all at once, by what the passes read of them; whatever else differs shows in all of the image, or
might, and then all of it is drawn.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.plan.plan import Plan
from defshade_cli.plan.redrawing import Redrawing
from defshade_cli.scene.geometry import Drawable, world_boxes
from defshade_cli.scene.light import CylinderLight
from defshade_cli.scene.scene import Scene

_BY_INSTANCE = ("world_from_object", "instance_ids", "display_color", "display_opacity", "link_sets")
_OF_THE_SCENE = ("materials", "lights", "labels", "lit_by")
_APART = frozenset(("camera", "display_camera", "lights", "redrawing", "levels", "time_limit"))
"""Fields of a plan that are compared otherwise, or that no pixel depends on."""

_SHADOW_PIXELS = 64.0
"""Boxes of shadows that look smaller are not cut."""


def find_redrawing(before: Scene, planned: Plan, scene: Scene, plan: Plan) -> Redrawing:
    """Of `scene` after `before`, each with its plan."""
    if reason := next(_reasons(before, planned, scene, plan), ""):
        return Redrawing(reason)
    changed = _changed_rows(before, scene)
    if changed is None:
        return Redrawing("other things are drawn")
    places = [_places(one, changed) for one in (before, scene)]
    moved, radii = (np.concatenate(column) for column in zip(*places, strict=True))
    if not np.isfinite(moved).all():
        return Redrawing("what moves is not finite")
    if plan.keeps_maps:
        return Redrawing("", moved, len(changed), by_maps=True)
    shadowed = _shadowed(scene, plan, moved, radii)
    if shadowed is None:
        return Redrawing("shadows of what moves fall far and wide")
    return Redrawing("", np.concatenate([moved, shadowed]), len(changed))


def _shadowed(
    scene: Scene, plan: Plan, moved: NDArray[np.float64], radii: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    casting = [planned for planned in plan.lights if plan.shadows and planned.light.casts_shadow]
    lights = [(p.light, p.light.spread if plan.samples * p.points > 1 else 0.0) for p in casting]
    if not (lights and len(moved)):
        return moved[:0]
    left, right, _, _ = plan.camera.window
    side = _SHADOW_PIXELS * (right - left) / plan.size[0]
    from defshade_cli.plan.shadow_reach import shadowed_boxes

    return shadowed_boxes(scene, lights, plan.shadow_resolution, (moved.mean(axis=1), radii), side)


def _reasons(before: Scene, planned: Plan, scene: Scene, plan: Plan) -> Iterator[str]:
    """Why all of the image may look otherwise, as far as there are reasons."""
    cameras = [(one.camera, *(moment.camera for moment in one.neighbours)) for one in (before, scene)]
    if len(cameras[0]) != len(cameras[1]) or not all(map(_are_equal, *cameras)):
        yield "the camera moves"
    if any(not _same(getattr(before, name), getattr(scene, name)) for name in _OF_THE_SCENE):
        yield "lights or materials change"
    if _light_terms(planned) != _light_terms(plan):
        yield "lights reach otherwise"
    kept = (f.name for f in fields(plan) if f.name not in _APART)
    if any(not _same(getattr(planned, name), getattr(plan, name)) for name in kept):
        yield "it is planned otherwise"
    fitted = plan.shadows or any(isinstance(planned.light, CylinderLight) for planned in plan.lights)
    if fitted and not np.array_equal(before.roomy_bounds, scene.roomy_bounds):
        yield "lights are fitted to other bounds"
    if plan.shadows_lamps or any(plan.shadows_sky(dome) for dome in plan.domes):
        yield "rays find what moves from anywhere"
    if plan.moments:
        yield "what moves is seen at more than one time"
    if any(dome.points for dome in plan.domes):
        yield "a dome is sampled by what the image shows"
    if plan.tracks_error or plan.time_limit is not None or plan.debug or plan.mattes:
        yield "layers or limits concern all of it"


def _light_terms(plan: Plan) -> list[tuple[Any, ...]]:
    """What plan/lights.py has chosen for each."""
    return [
        (p.number, p.volume, p.reach, p.is_empty, p.groups, p.points, p.by_rays, p.samples_whole) for p in plan.lights
    ]


def _changed_rows(before: Scene, scene: Scene) -> NDArray[np.int64] | None:
    """Which instances, counted through all drawables, look or move otherwise; None where they are others."""
    pairs = list(zip(before.drawables, scene.drawables, strict=False))
    if len(before.drawables) != len(scene.drawables) or len(before.meshes) != len(scene.meshes):
        return None
    if not all(_are_named_alike(old, new) for old, new in pairs):
        return None
    others = np.array([old is not new for old, new in zip(before.meshes, scene.meshes, strict=True)], bool)
    changed = others[_mesh_numbers(scene)]
    for name in _BY_INSTANCE if pairs else ():
        old, new = (np.concatenate([getattr(d, name) for d in s.drawables]) for s in (before, scene))
        changed = changed | (old != new).reshape(len(changed), -1).any(axis=1)
    for then, now in zip(before.neighbours, scene.neighbours, strict=True) if pairs else ():
        others = np.array([old is not new for old, new in zip(then.points, now.points, strict=True)], bool)
        changed = changed | others[_mesh_numbers(scene)]
        changed |= (np.concatenate(then.placements) != np.concatenate(now.placements)).any(axis=(1, 2))
    return np.flatnonzero(changed)


def _are_named_alike(old: Drawable, new: Drawable) -> bool:
    counts = len(old.world_from_object) == len(new.world_from_object)
    return counts and (old.mesh, old.subsets, old.paths) == (new.mesh, new.subsets, new.paths)


def _mesh_numbers(scene: Scene) -> NDArray[np.int64]:
    """(I,) of all instances."""
    counts = [len(drawable.world_from_object) for drawable in scene.drawables]
    return np.repeat(np.array([drawable.mesh for drawable in scene.drawables], np.int64), counts)


def _places(scene: Scene, rows: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Boxes (N, 2, 3) around some instances, and the radii (N,) of balls about the middles of those; world space."""
    if not len(rows):
        return np.empty((0, 2, 3)), np.empty(0)
    numbers = _mesh_numbers(scene)[rows]
    matrices = np.concatenate([d.world_from_object for d in scene.drawables])[rows]
    used, which = np.unique(numbers, return_inverse=True)
    meshes = [scene.meshes[number] for number in used.tolist()]
    bounds, radii = (np.array([getattr(mesh, name) for mesh in meshes])[which] for name in ("bounds", "radius"))
    return world_boxes(bounds, matrices), radii * np.linalg.norm(matrices[:, :3, :3], ord=2, axis=(1, 2))


def _same(old: Any, new: Any) -> bool:
    """Equal; of sequences of things that have no equality, the very same things."""
    if isinstance(old, Sequence) and not isinstance(old, str):
        return len(old) == len(new) and all(a is b or a == b for a, b in zip(old, new, strict=True))
    return bool(old is new or old == new)


def _are_equal(old: Any, new: Any) -> bool:
    """Do two records hold equal values, arrays among them?"""
    return all(np.array_equal(getattr(old, f.name), getattr(new, f.name)) for f in fields(old))
