"""What stands for each light in one sample, and the shadow maps that it takes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defshade_cli.passes.accumulation import Sample
from defshade_cli.passes.shadows import CAPACITY, shadow_cameras
from defshade_cli.plan import Plan, PlannedLight
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.emission import Emitter, emitter_at, far_field
from defshade_cli.scene.light import DistantLight
from defshade_cli.scene.scene import Scene


@dataclass(frozen=True, slots=True, eq=False)
class LitSample:
    """One light in one sample. shadow_cameras: relative to the eye; none for a light that casts no shadow."""

    planned: PlannedLight
    emitter: Emitter
    shadow_cameras: tuple[Camera, ...]


def light_batches(scene: Scene, plan: Plan, sample: Sample) -> Iterator[list[LitSample]]:
    """All of the plan's lights in order, in runs whose shadow maps fit the atlas together."""
    bounds = scene.bounds - plan.camera.position
    batch: list[LitSample] = []
    used = 0
    for number, planned in enumerate(plan.lights):
        lit = _lit_sample(number, planned, plan, sample, bounds)
        if used + len(lit.shadow_cameras) > CAPACITY:
            yield batch
            batch, used = [], 0
        batch.append(lit)
        used += len(lit.shadow_cameras)
    if batch:
        yield batch


def _lit_sample(
    number: int, planned: PlannedLight, plan: Plan, sample: Sample, bounds: NDArray[np.float64]
) -> LitSample:
    light = planned.light
    emitter = far_field(light) if plan.samples == 1 else emitter_at(light, sample.on_light(number))
    if not (plan.shadows and light.casts_shadow):
        return LitSample(planned, emitter, ())
    relative = emitter.relative_to(plan.camera.position)
    cameras = shadow_cameras(relative, light.shaping, bounds, distant=isinstance(light, DistantLight))
    return LitSample(planned, emitter, cameras)
