"""What stands for each light in one sample, and the shadow maps that it takes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.image.environment import sky_of
from defshade_cli.passes.lattices import Triple
from defshade_cli.passes.sampling import Sample, samples
from defshade_cli.passes.shadow_atlas import AtlasRoom
from defshade_cli.passes.shadow_cameras import ShadowExtent, shadow_cameras
from defshade_cli.passes.sky_guide import NO_GUIDES, SkyGuides
from defshade_cli.plan import Plan, PlannedLight
from defshade_cli.plan.points import share_shown
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.emission import Emitter, emitter_at, far_field, sky_emitter
from defshade_cli.scene.environment import Environment
from defshade_cli.scene.geometry import box_corners
from defshade_cli.scene.light import DomeLight, Light, RectLight
from defshade_cli.scene.mesh_light import MeshLight
from defshade_cli.scene.scene import Scene
from defshade_cli.spaces import Window

if TYPE_CHECKING:
    from defshade_cli.scene.distribution import GridDistribution
    from defshade_cli.scene.radiance_map import RadianceMap

_MIDDLE = 0.0, 0.0, 0.5
"""Of a ball and of a cone of directions."""

_MOST_BALANCED = 4096
"""Directions of a sky, which are all drawn before the first sample."""


@dataclass(frozen=True, slots=True, eq=False)
class LitSample:
    """One light in one sample. shadow_cameras: relative to the eye; none for a light that casts no shadow."""

    planned: PlannedLight
    emitter: Emitter
    shadow_cameras: tuple[Camera, ...]


def light_batches(scene: Scene, plan: Plan, sample: Sample, guides: SkyGuides = NO_GUIDES) -> Iterator[list[LitSample]]:
    """All of the plan's lights in order, in runs whose shadow maps fit the atlas together; none to light nothing."""
    if scene.is_empty:
        return
    extent = shadow_extent(scene, plan)
    batch: list[LitSample] = []
    room = AtlasRoom(plan.shadow_resolution)
    for number, planned in enumerate(plan.lights):
        for emitter in _emitters(number, planned, plan, sample, extent, guides):
            lit = _lit_sample(planned, emitter, plan, extent)
            if not room.holds(len(lit.shadow_cameras)):
                yield batch
                batch, room = [], AtlasRoom(plan.shadow_resolution)
            batch.append(lit)
            room.take(len(lit.shadow_cameras))
    if batch:
        yield batch


def _emitters(
    number: int, planned: PlannedLight, plan: Plan, sample: Sample, extent: ShadowExtent, guides: SkyGuides
) -> list[Emitter]:
    """One for most lights; some directions for a dome, and none where its analytic term stands in for them."""
    light = planned.light
    if isinstance(light, DomeLight):
        count, sky, guide = planned.points, sky_of(light), guides.get(light)
        balance = _sky_balance(sky, guide, number, count, plan.samples) if count else None
        places = [sample.on_light(number, k, count) for k in range(count)]
        directions = [sky_emitter(light, sky, u[:2], 1.0 / count, guide, balance) for u in places]
        return [direction.shared_by(plan.samples) for direction in directions]
    if planned.samples_whole:
        point = emitter_at(light, _MIDDLE if plan.samples == 1 else sample.on_round(number), light.position)
        return [point.shown_as(light, share_shown(sample.index, planned.samples_whole))]
    if plan.samples * planned.points == 1:
        return [far_field(light)]
    towards = middle_of(extent, plan)
    place = _place_on(light, sample)
    places = [place(number, k, planned.points) for k in range(planned.points)]
    points = [emitter_at(light, u, towards, inside=planned.is_empty) for u in places]
    if isinstance(light, RectLight) and light.radiance_map:
        mean = _mean_weight(light.radiance_map, number, planned.points, plan.samples)
        points = [replace(point, intensity=point.intensity / mean) for point in points]
    return [point.one_of(planned.points).shared_by(plan.samples) for point in points]


def _place_on(light: Light, sample: Sample) -> Callable[[int, int, int], Triple]:
    """By its shape; where triangles or texels are drawn first, each sample by itself."""
    if isinstance(light, MeshLight) or (isinstance(light, RectLight) and light.radiance_map):
        return sample.on_light
    return sample.on_rectangle if isinstance(light, RectLight) else sample.on_round


@lru_cache(maxsize=2)
def _sky_balance(
    sky: Environment, density: GridDistribution | None, number: int, points: int, count: int
) -> NDArray[np.float64] | None:
    """Of all directions of a sky in `count` samples; None where they are so many that they hardly need it."""
    if points * count > _MOST_BALANCED:
        return None
    drawn = [sky.sample(s.on_light(number, k, points)[:2], density) for s in samples(count) for k in range(points)]
    return sky.balance(np.array([sample[0] for sample in drawn]), np.array([sample[1] for sample in drawn]))


@lru_cache(maxsize=16)
def _mean_weight(shown: RadianceMap, number: int, points: int, count: int) -> NDArray[np.float64]:
    """(3,) of all points of an image in `count` samples; divided by it, few points have its colour as a whole."""
    drawn = [shown.sample(s.on_light(number, k, points)[:2])[1] for s in samples(count) for k in range(points)]
    mean = np.mean(drawn, axis=0)
    return np.where(mean > 0.0, mean, 1.0)


def middle_of(extent: ShadowExtent, plan: Plan) -> NDArray[np.float64]:
    """(3,) world space: of what is lit, which some lights' points turn to."""
    return np.asarray(extent.receivers.mean(axis=0) + plan.camera.position)


def shadow_extent(scene: Scene, plan: Plan) -> ShadowExtent:
    """Casters: the scene's roomy bounds. Receivers: their part of the box around the view's frustum."""
    bounds = scene.roomy_bounds - plan.camera.position
    rotation, (left, right, bottom, top) = plan.camera.world_from_camera[:3, :3], _filtered_window(plan)
    scales = plan.clip if plan.camera.projection == "perspective" else (1.0, 1.0)
    rays = np.array(list(product((left, right), (bottom, top))))
    frustum = [np.column_stack([rays * s, np.full(4, -z)]) for s, z in zip(scales, plan.clip, strict=True)]
    corners = np.concatenate(frustum) @ rotation.T
    low, high = np.maximum(bounds[0], corners.min(axis=0)), np.minimum(bounds[1], corners.max(axis=0))
    seen = np.stack([low, high]) if (low <= high).all() else bounds
    return ShadowExtent(box_corners(seen), box_corners(bounds), plan.shadow_resolution)


def _filtered_window(plan: Plan) -> Window:
    """The window and what filters of the outermost pixels see around it."""
    left, right, bottom, top = plan.camera.window
    reach = 0.5 * max(plan.filter_width - 1.0, 0.0)
    x, y = reach * (right - left) / plan.size[0], reach * (top - bottom) / plan.size[1]
    return left - x, right + x, bottom - y, top + y


def _lit_sample(planned: PlannedLight, emitter: Emitter, plan: Plan, extent: ShadowExtent) -> LitSample:
    light = planned.light
    within_itself = (
        isinstance(light, MeshLight) and plan.samples * planned.points == 1
    )  # its far field shines from amid its own surface
    if not (plan.shadows and light.casts_shadow) or within_itself:
        return LitSample(planned, emitter, ())
    relative = emitter.relative_to(plan.camera.position)
    cameras = shadow_cameras(relative, light.shaping, extent, distant=light.is_infinite)
    return LitSample(planned, emitter, cameras)
