"""The check after each frame: found, traced, filled; and the files of a frame that is not sound."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from defshade_cli.errors import UnsoundImage
from defshade_cli.farm.targets import FINGERPRINT
from defshade_cli.image.reading import read, read_header
from defshade_cli.image.soundness import check, filled
from defshade_cli.rendering import run
from defshade_cli.settings import OnNan, OutputSettings, RenderJob, RenderSettings
from films import film, with_beauty

STAGE = """#usda 1.0
def Sphere "ball" {}
def DistantLight "sun" {}
def DistantLight "broken" {
    float inputs:intensity = 1
    float inputs:exposure = 200
}
"""
"""2^200 nits pass what float32 holds."""


@pytest.fixture
def job(tmp_path: Path) -> RenderJob:
    (tmp_path / "ball.usda").write_text(STAGE)
    output = OutputSettings((str(tmp_path / "f.exr"),), full_float=True)
    return RenderJob(tmp_path / "ball.usda", (1.0,), settings=RenderSettings(size=(16, 9)), output=output)


def on_nan(job: RenderJob, choice: OnNan) -> RenderJob:
    return replace(job, output=replace(job.output, on_nan=choice))


def test_a_sound_film_has_nothing_odd() -> None:
    found = check(film())
    assert not found.odd
    assert found.ranges["depth"].high == np.inf


def test_odd_pixels_are_found_and_filled_from_their_neighbours() -> None:
    values = np.full((5, 7, 4), 0.25, np.float32)
    values[2, 3, 1], values[0, 0, 0] = np.nan, np.inf
    holed = with_beauty(values)
    found = check(holed)
    assert set(zip(*map(tuple, np.nonzero(found.odd["beauty"])), strict=True)) == {(0, 0), (2, 3)}
    assert (filled(holed, found.odd).layers["beauty"] == 0.25).all()


def test_a_film_of_nothing_but_nan_becomes_black() -> None:
    holed = with_beauty(np.full((3, 3, 4), np.nan))
    assert (filled(holed, check(holed).odd).layers["beauty"] == 0.0).all()


def test_black_counts_what_is_covered() -> None:
    values = np.zeros((2, 2, 4), np.float32)
    values[0, :, 3] = 1.0
    values[0, 0, 1] = 0.5
    assert check(with_beauty(values)).black == 0.5


def test_an_error_names_pixel_prim_and_light_once_the_frame_is_written(job: RenderJob, tmp_path: Path) -> None:
    with pytest.raises(UnsoundImage, match=r"beauty at pixel \d+,\d+, which shows /ball, lit by /broken") as caught:
        list(run(job))
    assert caught.value.exit_code == 5
    assert (tmp_path / "f.exr").exists()
    assert FINGERPRINT not in read_header(tmp_path / "f.exr")


def test_a_warning_goes_on(job: RenderJob, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "defshade"):
        (result,) = run(on_nan(job, "warn"))
    assert "lit by /broken" in caplog.text
    assert not np.isfinite(read(result.paths[0])["beauty"]).all()


def test_what_is_filled_is_finite_and_finished(job: RenderJob) -> None:
    (result,) = run(on_nan(job, "fill"))
    assert np.isfinite(read(result.paths[0])["beauty"]).all()
    assert FINGERPRINT in read_header(result.paths[0])


def test_a_black_image_is_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "dark.usda").write_text(
        '#usda 1.0\ndef Sphere "ball" {}\ndef DistantLight "sun" {\nfloat inputs:intensity = 0\n}\n'
    )
    with caplog.at_level(logging.WARNING, "defshade"):
        list(run(RenderJob(tmp_path / "dark.usda", settings=RenderSettings(size=(16, 9)))))
    assert "the image is black" in caplog.text
