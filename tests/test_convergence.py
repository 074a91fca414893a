"""What is known of the error of a mean: batch means, tiles that stop, and what ends a render."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from build import beauty, camera, drawable, quad, rotated, scene
from defshade_cli.cli.render import render
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.film import Film
from defshade_cli.image.reading import read_header
from defshade_cli.passes.accumulation import STEP, AccumulationPass
from defshade_cli.passes.batch_means import BATCHES, BatchMeansPass
from defshade_cli.passes.convergence import FEWEST, TILE, Convergence
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.passes.screen import Screen, regions_of
from defshade_cli.plan import make_plan
from defshade_cli.scene.material import Material
from defshade_cli.settings import MOST_SAMPLES, RenderSettings

GLOWING = Material("/glow", diffuse_color=(0, 0, 0), emissive_color=(1, 1, 1))
LAYERS = ("beauty", "variance", "sampleCount")
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
SIZE = (8, 4)


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def accumulated(gpu: Gpu, values: NDArray[np.float32]) -> tuple[AccumulationPass, BatchMeansPass]:
    """The sums of (N, 4) values, one a sample, the same in all pixels."""
    frame, screen = Frame(gpu), Screen(gpu)
    sums, batches = AccumulationPass(gpu, frame, screen), BatchMeansPass(gpu, frame, screen)
    sums.begin(SIZE, len(values))
    batches.begin(SIZE)
    sample = frame.radiance("sample", SIZE)
    for value in values:
        sample.framebuffer.clear(*value.tolist())
        sums.add(sample)
        batches.note(sums)
    return sums, batches


def batch_variance(luminance: NDArray[np.float64], batch: int) -> float:
    whole = len(luminance) // batch
    means = luminance[: whole * batch].reshape(whole, batch).mean(axis=1)
    return float(means.var(ddof=1) * batch / len(luminance))


@pytest.mark.parametrize(("count", "batch"), [(2, 1), (7, 1), (8, 1), (9, 2), (16, 2), (100, 16), (2 * STEP + 40, 128)])
def test_the_variance_is_that_of_batch_means(gpu: Gpu, count: int, batch: int) -> None:
    """Sums in float32 lose 1e-5 of a mean at most, and the variance of so few values is of the mean's own size."""
    values = np.random.default_rng(count).random((count, 4), np.float32)
    sums, batches = accumulated(gpu, values)
    mean, variance = batches.read()
    luminance = values[:, :3].astype(np.float64) @ LUMINANCE
    np.testing.assert_allclose(variance, batch_variance(luminance, batch), rtol=1e-3)
    whole = count // batch * batch
    np.testing.assert_allclose(mean, luminance[:whole].mean(), rtol=1e-5)
    np.testing.assert_allclose(sums.mean(np.full((4, 8, 1), count, np.int32))[0, 0], values.mean(axis=0), rtol=2e-5)
    assert batches.are_complete == (count == BATCHES * batch)


def test_a_single_sample_says_nothing_of_its_error(gpu: Gpu) -> None:
    _, batches = accumulated(gpu, np.ones((1, 4), np.float32))
    assert np.isinf(batches.read()[1]).all()


def test_sums_of_65536_samples_do_not_drift(gpu: Gpu) -> None:
    """Plain float32 would round each sum in the same direction, up to 2e-3 in all; steps keep to 2 · 256 · ε/2."""
    value = np.float32(1.0 + 2.0**-8 + 2.0**-16)
    frame, screen = Frame(gpu), Screen(gpu)
    sums = AccumulationPass(gpu, frame, screen)
    sums.begin((1, 1), 65536)
    sample = frame.radiance("sample", (1, 1))
    sample.framebuffer.clear(*[float(value)] * 4)
    for _ in range(65536):
        sums.add(sample)
    np.testing.assert_allclose(sums.mean(np.full((1, 1, 1), 65536, np.int32)), value, rtol=3.1e-5)


def test_errors_are_relative_to_tiles_and_dark_ones_to_the_image() -> None:
    tiles = Convergence((2 * TILE, TILE + 5), None)
    luminance = np.zeros((TILE + 5, 2 * TILE, 1), np.float32)
    luminance[:TILE, :TILE], luminance[TILE:, TILE:] = 2.0, 0.01
    tiles.judge(luminance, np.full_like(luminance, 1e-4), 16)
    floor = 0.1 * (2.0 + 0.01) / 4
    np.testing.assert_allclose(tiles.error, [[0.005, 0.01 / floor], [0.01 / floor, 0.01 / floor]], rtol=1e-5)
    assert tiles.estimate == tiles.error.max()


def test_finished_tiles_keep_what_is_known_of_them() -> None:
    tiles = Convergence((2 * TILE, TILE), 0.05)
    luminance = np.ones((TILE, 2 * TILE, 1), np.float32)
    variance = np.full_like(luminance, 1e-4)
    variance[:, TILE:] = 1e-2
    tiles.judge(luminance, variance, FEWEST)
    assert tiles.active.tolist() == [[False, True]]
    tiles.judge(luminance, variance / 100, 2 * FEWEST)
    assert tiles.samples.tolist() == [[FEWEST, 2 * FEWEST]]
    assert tiles.error[0].tolist() == pytest.approx([0.01, 0.01])
    assert tiles.has_arrived
    counts = tiles.sample_count()
    assert counts.shape == (TILE, 2 * TILE, 1)
    assert counts[0, TILE - 1 : TILE + 1, 0].tolist() == [FEWEST, 2 * FEWEST]


def test_regions_are_runs_of_tiles_within_the_image_joined_over_rows() -> None:
    tiles = np.array([[True, True, False, True], [False, False, False, True]])
    regions = regions_of(tiles, TILE, (4 * TILE, TILE + 8))
    last = TILE / (TILE + 8)
    np.testing.assert_allclose(regions, [[0, 0, 0.5, last], [0.75, 0, 1, 1]], rtol=1e-6)


def rendered(pipeline: Pipeline, of: object, **options: object) -> Film:
    plan = make_plan(of, RenderSettings(layers=LAYERS, **options))  # type: ignore[arg-type]
    return pipeline.render(of, plan)  # type: ignore[arg-type]


GLOW = scene([quad(0.69)], [], [GLOWING], camera(5.0, 0.4))


def test_a_tile_is_what_as_many_samples_make_of_it(pipeline: Pipeline) -> None:
    """Bit by bit, whether its neighbours stopped before or went on; and twice the same."""
    film = rendered(pipeline, GLOW, size=(160, 120), max_error=0.003, samples=64)
    again = rendered(pipeline, GLOW, size=(160, 120), max_error=0.003, samples=64)
    np.testing.assert_array_equal(film.layers["beauty"], again.layers["beauty"])
    counts = film.layers["sampleCount"][..., 0]
    assert len(np.unique(counts)) > 1
    for count in np.unique(counts).astype(int):
        whole = rendered(pipeline, GLOW, size=(160, 120), samples=int(count))
        np.testing.assert_array_equal(film.layers["beauty"][counts == count], whole.layers["beauty"][counts == count])
        np.testing.assert_allclose(
            film.layers["variance"][counts == count], whole.layers["variance"][counts == count], rtol=1e-6
        )


def test_layers_of_the_error_do_not_change_the_picture(pipeline: Pipeline) -> None:
    plan = make_plan(GLOW, RenderSettings(size=(40, 30), samples=12))
    plain = pipeline.render(GLOW, plan).layers["beauty"]
    assert not plan.tracks_error
    np.testing.assert_array_equal(rendered(pipeline, GLOW, size=(40, 30), samples=12).layers["beauty"], plain)


def test_what_ended_the_render_is_said(pipeline: Pipeline) -> None:
    def facts(**options: object) -> dict[str, object]:
        return rendered(pipeline, GLOW, size=(64, 48), **options).metadata

    reached = facts(max_error=0.5)
    assert reached["stopped_by"] == "max-error"
    assert reached["samples"] < MOST_SAMPLES  # type: ignore[operator]
    assert reached["error"] <= 0.5  # type: ignore[operator]
    short = facts(max_error=1e-5, samples=24)
    assert (short["stopped_by"], short["samples"]) == ("samples", 24)
    assert facts(time_limit=1e-9)["stopped_by"] == "time-limit"
    assert facts(samples=1)["error"] is None and facts(samples=1, max_error=0.5)["samples"] == 1


def test_the_most_samples_without_a_number() -> None:
    assert RenderSettings().most_samples == 1
    assert RenderSettings(max_error=0.1).most_samples == RenderSettings(time_limit=1.0).most_samples == MOST_SAMPLES
    assert RenderSettings(max_error=0.1, samples=7).most_samples == 7


def test_the_estimate_holds_on_edges(pipeline: Pipeline) -> None:
    """True errors are at most 1.5 times the estimate in 95 % of the tiles with any: slanting edges."""
    turned = rotated("z", 20.0)
    of = scene([quad(1.2)], [], [GLOWING], camera(5.0, 0.4), [drawable(quad(1.2), where=[turned])])
    film = rendered(pipeline, of, size=(128, 128), max_error=0.05, samples=256)
    limit = rendered(pipeline, of, size=(128, 128), samples=1024)
    difference = (beauty(film.layers) - beauty(limit.layers)) @ LUMINANCE
    estimated, true = Convergence((128, 128), None), Convergence((128, 128), None)
    estimated.judge(film.layers["beauty"], film.layers["variance"], 1)
    true.judge(film.layers["beauty"], (difference**2)[..., None].astype(np.float32), 1)
    assert film.metadata["stopped_by"] == "max-error"
    noisy = true.error > 0.0
    assert (true.error <= 1.5 * estimated.error)[noisy].mean() >= 0.95


def test_the_command_line(tmp_path: Path, scenes: Path) -> None:
    stage, stats = str(scenes / "light_rect.usda"), tmp_path / "stats.json"
    refused = CliRunner().invoke(render, [stage, "--max-error", "0"])
    assert refused.exit_code == 2
    assert "'0' is not above 0" in refused.output
    arguments = [stage, "-o", str(tmp_path / "a.exr"), "--size", "64x36", "--stats", str(stats), "--max-error", "0.3"]
    done = CliRunner().invoke(render, [*arguments, "--layers", "beauty,variance,sampleCount"])
    assert done.exit_code == 0, done.output
    film = json.loads(stats.read_text())["frames"][0]["images"][0]["film"]
    assert film["stopped_by"] == "max-error"
    assert film["error"] <= 0.3
    assert film["samples_min"] <= film["samples_mean"] <= film["samples"] < MOST_SAMPLES
    header = read_header(tmp_path / "a.exr")
    assert (header["stopped_by"], header["samples"]) == ("max-error", film["samples"])
