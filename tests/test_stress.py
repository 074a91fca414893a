"""The corners of the arithmetic: finite, and exact where float32 can hold the exact value."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from defshade_cli.gpu.context import Gpu
from defshade_cli.measure.brdf import evaluate_brdf
from defshade_cli.measure.furnace import dielectric, metal, seen_from
from defshade_cli.measure.layouts import first_frame
from defshade_cli.measure.stress.corner import Corner
from defshade_cli.measure.stress.corners import all_corners
from defshade_cli.measure.stress.stage import StressStage
from defshade_cli.measure.stress.table import summary
from defshade_cli.measure.stress.verdict import BOUND, Verdict, judge
from defshade_cli.passes.accumulation import AccumulationPass
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.passes.screen import Screen
from defshade_cli.usd.values import STANDS_NOWHERE
from gpu_harness import BrdfHarness

CORNERS = all_corners()


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


@pytest.mark.parametrize("corner", CORNERS, ids=lambda c: f"{c.family}-{c.name}")
def test_a_corner_is_finite_and_exact(corner: Corner, pipeline: Pipeline, tmp_path: Path) -> None:
    verdict = judge(corner, pipeline, tmp_path)
    assert verdict.odd == 0
    assert verdict.worst <= BOUND or corner.why


def test_an_exception_is_still_one(pipeline: Pipeline, tmp_path: Path) -> None:
    """A corner that has become exact must not go on with an excuse."""
    for corner in (corner for corner in CORNERS if corner.why):
        assert judge(corner, pipeline, tmp_path).worst > BOUND, corner.name


@pytest.mark.parametrize(
    ("stage", "said"),
    [
        (StressStage(surface="float inputs:metallic = nan"), "metallic (not finite)"),
        (StressStage(surface="float inputs:ior = -2"), "ior (below 0)"),
        (StressStage(lights='def DomeLight "sky" {\nfloat inputs:intensity = inf\n}'), "inputs:intensity"),
        (StressStage(camera="float exposure = nan"), "exposure is not finite"),
        (StressStage(camera="float fStop = 1e-20\nfloat focusDistance = 6"), "f_stop of 1e-20 is a lens"),
    ],
)
def test_what_is_not_finite_is_named(stage: StressStage, said: str, tmp_path: Path) -> None:
    path = tmp_path / "corner.usda"
    path.write_text(stage.text())
    assert any(said in issue.reason for issue in first_frame(path).unsupported)


def test_a_transform_that_is_not_finite_leaves_its_prim_out(tmp_path: Path) -> None:
    (corner,) = (c for c in CORNERS if c.name == "ball nan")
    path = tmp_path / "corner.usda"
    path.write_text(corner.stage.text())
    scene = first_frame(path)
    assert [d.paths for d in scene.drawables] == [("/floor",)]
    assert ("/ball", STANDS_NOWHERE) in [(i.path, i.reason) for i in scene.unsupported]


def test_65536_samples_do_not_drift(gpu: Gpu) -> None:
    """A third has no end in binary: naive float32 sums of so many are off by 1e-3 and more."""
    frame, screen, size, count = Frame(gpu), Screen(gpu), (4, 4), 1 << 16
    accumulation = AccumulationPass(gpu, frame, screen)
    sample = frame.radiance("sample", size)
    sample.framebuffer.clear(1 / 3, 0.1, 1e-3, 1.0)
    accumulation.begin(size, count)
    for _ in range(count):
        accumulation.add(sample)
    mean = accumulation.mean(np.full((4, 4, 1), count, np.int32))
    exact = np.array([1 / 3, 0.1, 1e-3, 1.0], np.float32)
    assert np.abs(mean / exact - 1.0).max() < 4e-5


@pytest.mark.parametrize("shading", ["preview-surface", "classic"])
def test_reflection_at_grazing_angles_is_finite(gpu: Gpu, shading: str) -> None:
    """n·v and n·l down to 1e-7, roughness down to 0: the shader against float64."""
    harness = BrdfHarness(gpu, shading)  # type: ignore[arg-type]
    cosines = np.geomspace(1e-7, 1.0, 29)
    azimuths = np.array([0.0, 1.0, np.pi])
    light_cosine, azimuth = (grid.ravel() for grid in np.meshgrid(cosines, azimuths))
    sine = np.sqrt(1.0 - light_cosine**2)
    light = np.column_stack([sine * np.cos(azimuth), sine * np.sin(azimuth), light_cosine])
    for roughness in (0.0, 1e-6, 1e-3, 0.05, 0.3, 1.0):
        for material in (dielectric(0.5, roughness), metal(0.9, roughness)):
            for cosine in (1e-7, 1e-4, 0.1, 1.0):
                view = np.array([-np.sqrt(1.0 - cosine**2), 0.0, cosine])
                surface = seen_from(material, view, len(light))
                shown = harness.evaluate_brdf(surface, light)
                assert np.isfinite(shown).all()
                if roughness >= 0.3:  # narrower lobes amplify the rounding of the directions themselves
                    exact = evaluate_brdf(surface, light, shading=shading)  # type: ignore[arg-type]
                    np.testing.assert_allclose(shown, exact, rtol=1e-3, atol=1e-9)


def test_the_table_names_what_passes_the_bound() -> None:
    excused = Verdict(Corner("a", "x", why="because"), 0.5)
    text = summary([excused, Verdict(Corner("a", "y"), 1e-6), Verdict(Corner("b", "z"), error="no")])
    for line in ("- a, x: 5.0e-01. Because.", "- b, z: `no`", "| a | 2 | 1.0e-06 | y"):
        assert line in text
