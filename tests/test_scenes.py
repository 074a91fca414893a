"""Every stage of this project, rendered and held against the float64 reference."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from defshade_cli import resources
from defshade_cli.gpu.context import Gpu
from defshade_cli.measure.error import RelativeError, relative_error
from defshade_cli.measure.layouts import first_frame, layout_errors, layout_table, referenced_stages
from defshade_cli.measure.sections import replace_generated
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import LAYOUTS, SHADINGS, RenderSettings, Shading

STAGES = [path.stem for path in referenced_stages()]
SIZE = (160, 90)

MEDIAN_BOUND = {"float": 1e-4, "packed": 0.0155, "rgba8": 0.037}
"""An albedo of at least 0.05 is off by no more than this after sRGB8 and after linear unorm8."""
TAIL_BOUND = {"float": 1e-3, "packed": 0.106, "rgba8": 0.60}
"""Of the 99.9th percentile: what the error of a normal, octahedral 12+12 or unorm8, does to D at roughness 0.1."""


BEYOND_BYTES = {"colorchecker"}
"""Stages with albedos below 0.05, and outside Rec.709, where bytes cannot follow: held to the float layout alone."""


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Iterator[Pipeline]:
    yield Pipeline(gpu)


@cache
def scene_of(stage: str) -> Scene:
    return first_frame(resources.SCENES / f"{stage}.usda")


@pytest.mark.parametrize("shading", SHADINGS)
@pytest.mark.parametrize("stage", STAGES)
def test_beauty_agrees_with_the_reference(pipeline: Pipeline, stage: str, shading: Shading) -> None:
    errors = layout_errors(
        pipeline, scene_of(stage), RenderSettings(size=SIZE, shading=shading, shadows=False, light_points=1)
    )
    for layout in LAYOUTS if stage not in BEYOND_BYTES else ("float",):
        assert errors[layout].lit > 1000
        assert errors[layout].median <= MEDIAN_BOUND[layout]
        assert errors[layout].p999 <= TAIL_BOUND[layout]


@pytest.mark.parametrize("stage", STAGES)
def test_stages_use_only_what_this_milestone_supports(stage: str) -> None:
    scene = scene_of(stage)
    assert scene.unsupported == ()
    assert scene.camera.path.endswith("/Camera")
    assert scene.lights


def test_far_from_origin_looks_like_the_origin(pipeline: Pipeline) -> None:
    """The same stage without its offset of 10^7 units, by moving everything back in float64."""
    settings = RenderSettings(size=SIZE, shadows=False, light_points=1)
    far = scene_of("far_from_origin")
    near = _moved(far, -far.camera.position)
    images = [pipeline.render(scene, make_plan(scene, settings)).layers["beauty"][..., :3] for scene in (far, near)]
    error = relative_error(images[0], images[1])
    assert error.p999 < 1e-3


def _moved(scene: Scene, offset: np.ndarray) -> Scene:
    shift = np.zeros((4, 4))
    shift[:3, 3] = offset
    return replace(
        scene,
        drawables=tuple(replace(d, world_from_object=d.world_from_object + shift) for d in scene.drawables),
        lights=tuple(replace(light, world_from_light=light.world_from_light + shift) for light in scene.lights),
        camera=replace(scene.camera, world_from_camera=scene.camera.world_from_camera + shift),
    )


def test_relative_error_counts_lit_pixels_only() -> None:
    reference = np.zeros((10, 10, 3))
    reference[:, :5] = 1.0
    image = reference.copy()
    image[0, 0] += 0.5
    image[:, 5:] += 1e-6
    error = relative_error(image, reference)
    assert (error.lit, error.median, error.worst) == (50, 0.0, 0.5)
    assert relative_error(image * np.nan, reference).median == np.inf
    assert relative_error(image, np.zeros((10, 10, 3))) == RelativeError(0.0, 0.0, 0.0, 0.0, 0)


def test_layout_table_replaces_the_generated_section() -> None:
    error = RelativeError(1e-7, 2e-7, 3e-7, 4e-7, 100)
    table = layout_table({"cube": dict.fromkeys(LAYOUTS, error)})
    page = "before\n<!-- generated: layouts -->\nold\n<!-- end generated -->\nafter\n"
    replaced = replace_generated(page, "layouts", table)
    assert "| cube | 1.0e-07 | 3.0e-07 |" in replaced
    assert "old" not in replaced
    assert replaced.startswith("before\n") and replaced.endswith("after\n")
    assert replace_generated(replaced, "layouts", table) == replaced
    with pytest.raises(ValueError, match="no section"):
        replace_generated(page, "other", table)
