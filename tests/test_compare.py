"""Comparison: numbers worked by hand, and what must never pass."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from defshade_cli.cli.compare import compare as command
from defshade_cli.errors import OutputError, UsageError
from defshade_cli.image import files, reading
from defshade_cli.image.compare import Comparison, compare, difference
from defshade_cli.settings import OutputSettings
from films import film

images = arrays(np.float32, (3, 4, 3), elements=st.floats(0, 100, width=32))


def only(a: np.ndarray, b: np.ndarray, *, flip: bool = False) -> Comparison:
    (result,) = compare(np.asarray(a, np.float32), np.asarray(b, np.float32), flip=flip)
    return result


def test_numbers_worked_by_hand() -> None:
    """Differences 0, 3, 0, −4 against 2, 0, 2, 4: mean square 25/4; relMSE (9/.01 + 16/16.01)/4."""
    result = only([[[2.0, 3.0], [2.0, 0.0]]], [[[2.0, 0.0], [2.0, 4.0]]])
    assert (result.layer, result.pixels) == ("beauty", 2)
    assert result.rmse == pytest.approx(2.5)
    assert result.rel_mse == pytest.approx((900 + 16 / 16.01) / 4)
    assert result.max_error == 4
    assert result.psnr == pytest.approx(20 * math.log10(4 / 2.5))


def test_the_peak_of_a_picture_is_one() -> None:
    assert only(np.full((2, 2, 3), 0.5), np.full((2, 2, 3), 0.4)).psnr == pytest.approx(20, abs=1e-4)


@given(images)
def test_equal_images_have_no_error(image: np.ndarray) -> None:
    result = only(image, image)
    assert (result.rmse, result.rel_mse, result.max_error, result.psnr) == (0, 0, 0, math.inf)
    assert result.within(0)


@given(images, images)
def test_errors_are_ordered(a: np.ndarray, b: np.ndarray) -> None:
    result = only(a, b)
    assert 0 <= result.rmse <= result.max_error * (1 + 1e-9)
    assert result.max_error == difference(a, b).max()
    assert only(b, a).rmse == pytest.approx(result.rmse)


def test_shared_infinity_is_no_error() -> None:
    depth = np.array([[[1.0], [np.inf]]])
    result = only(depth, depth)
    assert (result.rmse, result.nonfinite, result.unmatched) == (0, (1, 1), 0)


@pytest.mark.parametrize("odd", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_none_never_passes(odd: float) -> None:
    clean = np.ones((4, 4, 3))
    broken = clean.copy()
    broken[2, 1, 1] = odd
    for result, counts in ((only(broken, clean), (1, 0)), (only(clean, broken), (0, 1))):
        assert (result.nonfinite, result.unmatched) == (counts, 1)
        assert not result.within(math.inf)
        assert result.rmse == 0


def test_opposite_infinities_do_not_match() -> None:
    assert only([[[np.inf]]], [[[-np.inf]]]).unmatched == 1


def test_difference_marks_what_cannot_be_subtracted() -> None:
    a = np.array([[[1.0, np.nan, np.inf, np.nan]]])
    b = np.array([[[3.0, np.nan, np.inf, 0.0]]])
    assert difference(a, b).tolist() == [[[2, 0, 0, math.inf]]]
    assert difference(a, b).dtype == np.float32


def test_layers_of_files_are_matched_by_name(tmp_path: Path) -> None:
    whole, part = film("beauty", "depth", "normal"), film("depth", "beauty")
    for path, frame in ((tmp_path / "a.exr", whole), (tmp_path / "b.exr", part)):
        files.write(frame, OutputSettings(), path)
    results = compare(tmp_path / "a.exr", tmp_path / "b.exr", flip=False)
    assert {result.layer: result.rmse for result in results} == {"beauty": 0, "depth": 0}
    (depth,) = compare(whole.layers, tmp_path / "b.exr", ["depth"])
    assert (depth.layer, depth.rmse, depth.flip) == ("depth", 0, None)


def test_a_missing_alpha_is_left_out(tmp_path: Path) -> None:
    frame = film("beauty")
    opaque = replace(frame, layers={"beauty": np.dstack([frame.layers["beauty"][..., :3], np.ones((21, 37, 1))])})
    paths = [
        path for suffix in ("png", "ppm") for path in files.write(opaque, OutputSettings(), tmp_path / f"a.{suffix}")
    ]
    (result,) = compare(*paths, flip=False)
    assert result.rmse == 0


def test_what_cannot_be_compared_is_refused(tmp_path: Path) -> None:
    frame = film("beauty", "depth")
    with pytest.raises(UsageError, match="37x21 against 37x20"):
        compare(frame.layers, {"beauty": frame.layers["beauty"][:20]})
    with pytest.raises(UsageError, match="'normal' is missing: there are beauty, depth"):
        compare(frame.layers, frame.layers, ["normal"])
    with pytest.raises(UsageError, match="no layer in common"):
        compare({"depth": frame.layers["depth"]}, {"normal": frame.layers["depth"]})
    with pytest.raises(OutputError, match=r"none\.exr"):
        compare(tmp_path / "none.exr", frame.layers)


def test_flip_grows_with_the_error() -> None:
    pytest.importorskip("flip_evaluator")
    rng = np.random.default_rng(0)
    reference = rng.random((32, 32, 4), np.float32) * 4
    noisy = [only(reference + scale * rng.random((32, 32, 4)), reference, flip=True).flip for scale in (0, 0.1, 1)]
    assert noisy[0] == 0 and noisy[0] < noisy[1] < noisy[2] < 1


def test_flip_takes_the_exposures_of_its_evaluator() -> None:
    """Without black pixels the median of what is lit is the evaluator's own."""
    evaluator = pytest.importorskip("flip_evaluator")
    rng = np.random.default_rng(1)
    reference, test = (rng.random((24, 24, 3), np.float32) * 5 + 0.01 for _ in range(2))
    expected = evaluator.evaluate(reference, test, "HDR", applyMagma=False)[1]
    assert only(test, reference, flip=True).flip == pytest.approx(expected, rel=1e-3)


def test_flip_survives_a_black_background() -> None:
    pytest.importorskip("flip_evaluator")
    lit = np.zeros((16, 16, 3))
    lit[:4] = 2.0
    black = np.zeros((16, 16, 3))
    assert only(black, black, flip=True).flip == 0
    assert 0 < only(black, lit, flip=True).flip < 1
    assert 0 < only(lit, black, flip=True).flip < 1


def test_flip_of_pictures_is_the_display_referred_one(tmp_path: Path) -> None:
    evaluator = pytest.importorskip("flip_evaluator")
    frames = [film("beauty"), film("beauty")]
    frames[1].layers["beauty"][...] *= 0.5
    a, b = (files.write(f, OutputSettings(), tmp_path / f"{i}.png")[0] for i, f in enumerate(frames))
    (result,) = compare(a, b)
    rgb = [np.ascontiguousarray(reading.read(path)["beauty"][..., :3]) for path in (b, a)]
    assert result.flip == pytest.approx(evaluator.evaluate(*rgb, "LDR", applyMagma=False)[1])


def test_delta_e_is_that_of_the_published_pairs() -> None:
    """Equal colours are 0 apart; greys of L* 50 and 60 are 10 / S_L apart: Sharma, Wu, Dalal 2005, L* 55."""

    def grey(lightness: float) -> np.ndarray:
        return np.full((2, 2, 3), ((lightness + 16) / 116) ** 3, np.float32)

    (same,) = compare(grey(50), grey(50), flip=False, colour=True)
    (apart,) = compare(grey(60), grey(50), flip=False, colour=True)
    mean = 55.0
    weight = 1 + 0.015 * (mean - 50) ** 2 / np.sqrt(20 + (mean - 50) ** 2)
    assert same.delta_e == pytest.approx(0, abs=1e-3)
    assert apart.delta_e == pytest.approx(10 / weight, rel=2e-3)


def test_the_heat_map_is_black_where_nothing_differs(tmp_path: Path) -> None:
    pytest.importorskip("flip_evaluator")
    beauty = film("beauty")
    other = replace(beauty, layers={"beauty": beauty.layers["beauty"].copy()})
    other.layers["beauty"][8:16, 8:16, :3] += 1.0
    for name, frame in (("a.exr", other), ("b.exr", beauty)):
        files.write(frame, OutputSettings(), tmp_path / name)
    arguments = [str(tmp_path / name) for name in ("a.exr", "b.exr")]
    done = CliRunner().invoke(command, [*arguments, "--flip-map", str(tmp_path / "map.png"), "--delta-e", "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.output)["layers"][0]["delta_e"] > 0
    shown = reading.read(tmp_path / "map.png")["beauty"]
    assert shown[12, 12].max() > 0.5 > 0.05 > shown[0, 36].max()
