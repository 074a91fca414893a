"""Scene-linear pictures of this project's stages against the references in tests/references/.

The references were drawn by llvmpipe and are compared there alone. A failure leaves image, reference and difference in
build/test-images/. `DEFSHADE_REGENERATE=1 pytest tests/test_images.py` draws the references anew: look at them.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from defshade_cli import resources
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.compare import difference
from defshade_cli.image.files import write
from defshade_cli.image.film import Film
from defshade_cli.image.reading import read
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan, plan_moments
from defshade_cli.settings import OutputSettings, RenderSettings
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader

ROOT = Path(__file__).resolve().parent.parent
REFERENCES = ROOT / "tests" / "references"
FAILURES = ROOT / "build" / "test-images"
REGENERATE = "DEFSHADE_REGENERATE" in os.environ

SETTINGS = RenderSettings(size=(160, 90), light_points=1)
CASES: dict[str, tuple[str, float | None, RenderSettings]] = {
    **{path.stem: (path.stem, None, SETTINGS) for path in sorted(resources.SCENES.glob("*.usda"))},
    "animated.17": ("animated", 17.0, SETTINGS),
    "materials.unshadowed": ("materials", None, replace(SETTINGS, shadows=False)),
    "materials.classic": ("materials", None, replace(SETTINGS, shading="classic")),
    "materials.packed": ("materials", None, replace(SETTINGS, layout="packed")),
    "materials.rgba8": ("materials", None, replace(SETTINGS, layout="rgba8")),
    "purposes.guide": ("purposes", None, replace(SETTINGS, purposes=("default", "proxy", "guide"))),
    "subdivision.low": ("subdivision", None, replace(SETTINGS, complexity="low")),
    "light_rect_texture.32": ("light_rect_texture", None, replace(SETTINGS, samples=32)),
    "light_rect.points": ("light_rect", None, RenderSettings(size=(160, 90))),
    "motion_blur.16": ("motion_blur", 4.0, replace(SETTINGS, samples=16)),
    "showcase.8": ("showcase", None, replace(SETTINGS, samples=8)),
}
"""Reference → stage, frame, settings."""

TOLERANCE = 2e-3
"""Relative and absolute: four times the step of the half floats that the references are stored in."""
OUTLIERS = 0.005
"""Share of pixels that may differ more: another version of Mesa may draw a silhouette one pixel aside."""


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Iterator[Pipeline]:
    if not gpu.is_software:
        pytest.skip(f"the references are llvmpipe's, and this is {gpu.renderer}")
    yield Pipeline(gpu)


@pytest.mark.parametrize("name", CASES)
def test_picture_matches_its_reference(pipeline: Pipeline, name: str) -> None:
    film = _draw(pipeline, *CASES[name])
    path = REFERENCES / f"{name}.exr"
    if REGENERATE:
        _save(film, path)
    reference = read(path)["beauty"]
    if _outliers(film.layers["beauty"], reference) > OUTLIERS:
        _leave_evidence(film, reference, name)
        pytest.fail(f"{name} differs from its reference: see {FAILURES.relative_to(ROOT)}/{name}.*.exr")


def test_every_reference_has_a_stage() -> None:
    assert {path.stem for path in REFERENCES.glob("*.exr")} == set(CASES)


def test_a_few_wrong_pixels_are_tolerated_and_a_shift_is_not() -> None:
    rng = np.random.default_rng(0)
    reference = rng.random((90, 160, 4)).astype(np.float32)
    speckled = reference.copy()
    speckled[::30, ::30] += 1.0
    assert _outliers(speckled, reference) <= OUTLIERS
    assert _outliers(np.roll(reference, 1, axis=1), reference) > OUTLIERS
    assert _outliers(reference * np.float32(1.01), reference) > OUTLIERS


def _draw(pipeline: Pipeline, stage: str, frame: float | None, settings: RenderSettings) -> Film:
    opened = open_stage(resources.SCENES / f"{stage}.usda")
    options = ReadOptions(purposes=settings.purposes, complexity=settings.complexity, size=settings.size)
    reader = StageReader(opened, options)
    scene = reader.read(reader.first_frame() if frame is None else frame)
    plan = make_plan(scene, settings)
    moments = plan_moments(plan, reader.read_shutter(scene, plan.moments), settings)
    return pipeline.render(scene, plan, moments)


def _outliers(image: NDArray, reference: NDArray) -> float:
    """Share of pixels in which some channel is off by more than the tolerance."""
    return float((~np.isclose(image, reference, rtol=TOLERANCE, atol=TOLERANCE)).any(axis=-1).mean())


def _save(film: Film, path: Path) -> None:
    write(film, OutputSettings(), path)


def _leave_evidence(film: Film, reference: NDArray, name: str) -> None:
    image = film.layers["beauty"]
    for kind, pixels in (("image", image), ("reference", reference), ("difference", difference(image, reference))):
        _save(replace(film, layers={"beauty": pixels}), FAILURES / f"{name}.{kind}.exr")
