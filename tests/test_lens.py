"""Depth of field: what lies in the plane of focus stays sharp, the rest spreads to its circle of confusion."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from build import beauty, camera, quad, scene
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.passes.view import lens_offset
from defshade_cli.plan import make_plan
from defshade_cli.scene.material import Material
from defshade_cli.settings import RenderSettings

GLOWING = Material("/glow", diffuse_color=(0, 0, 0), emissive_color=(1, 1, 1))
LENS = replace(camera(5.0, 0.25), f_stop=1.0, focal_length=0.4, focus_distance=5.0)


def profile(pipeline: Pipeline, z: float, samples: int = 256) -> NDArray[np.float64]:
    """The middle row of a glowing square of half width 0.4 at height z."""
    of = scene([quad(0.4, z)], [], [GLOWING], LENS)
    plan = make_plan(of, RenderSettings(size=(128, 128), samples=samples))
    return beauty(pipeline.render(of, plan).layers)[64, :, 0]


def test_the_plane_of_focus_stays_sharp(gpu: Gpu) -> None:
    row = profile(Pipeline(gpu), 0.0)
    assert ((row > 0.01) & (row < 0.99)).sum() <= 2  # an edge's own pixels


def test_the_blur_is_the_circle_of_confusion(gpu: Gpu) -> None:
    """An edge at depth d blurs over the diameter of the circle of confusion, D · |1/f − 1/d| in tangents."""
    row = profile(Pipeline(gpu), 2.0)
    width = np.ptp(np.flatnonzero((row[:64] > 0.005) & (row[:64] < 0.995))) + 1
    expected = 0.4 * abs(1 / 5 - 1 / 3) / 0.5 * 128
    assert width == pytest.approx(expected, abs=2)


def test_a_pinhole_or_a_single_sample_has_no_lens() -> None:
    assert not lens_offset(replace(LENS, f_stop=0.0), (0.1, 0.9)).any()
    assert not lens_offset(LENS, (0.5, 0.5)).any()


def test_lens_points_fill_the_disk_evenly() -> None:
    grid = (np.arange(100) + 0.5) / 100
    points = np.array([lens_offset(LENS, (u, v)) for u in grid for v in grid])
    radius = np.linalg.norm(points[:, :2], axis=1) / 0.2
    assert radius.max() <= 1.0
    assert (radius < 0.5).mean() == pytest.approx(0.25, abs=0.01)
    np.testing.assert_allclose(points.mean(0), 0.0, atol=1e-12)
