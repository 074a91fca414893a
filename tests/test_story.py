"""The frames of a job: drawn one after another, each written while the next is drawn."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from defshade_cli.errors import OutputError, StageError
from defshade_cli.image.reading import read
from defshade_cli.rendering import Renderer, render, run, story
from defshade_cli.settings import Layout, OutputSettings, RenderJob, RenderSettings

STAGE = '#usda 1.0\ndef Sphere "ball" {}\ndef DistantLight "sun" {}\n'


@pytest.fixture
def job(tmp_path: Path) -> RenderJob:
    (tmp_path / "ball.usda").write_text(STAGE)
    output = OutputSettings((str(tmp_path / "f.#.exr"),))
    return RenderJob(tmp_path / "ball.usda", (1.0, 2.0, 3.0), settings=RenderSettings(size=(16, 9)), output=output)


def test_a_frame_is_written_while_the_next_is_drawn(job: RenderJob, monkeypatch: pytest.MonkeyPatch) -> None:
    """Writing the first frame waits until the second has been drawn: in turn they would wait for ever."""
    draw, write, second = story._draw, story.write, threading.Event()

    def telling(shot, *rest):  # type: ignore[no-untyped-def]
        drawn = draw(shot, *rest)
        if shot.frame == 2.0:
            second.set()
        return drawn

    def waiting(film, *rest):  # type: ignore[no-untyped-def]
        assert film.frame != 1.0 or second.wait(timeout=60)
        return write(film, *rest)

    monkeypatch.setattr(story, "_draw", telling)
    monkeypatch.setattr(story, "write", waiting)
    assert [result.frame for result in run(job)] == [1.0, 2.0, 3.0]


def test_what_is_yielded_is_on_disk(job: RenderJob) -> None:
    for result in run(job):
        (path,) = result.paths
        assert read(path)["beauty"].shape == (9, 16, 4)


def test_a_frame_that_cannot_be_drawn_loses_none_before_it(job: RenderJob, monkeypatch: pytest.MonkeyPatch) -> None:
    draw = story._draw

    def failing(shot, *rest):  # type: ignore[no-untyped-def]
        if shot.frame == 2.0:
            raise StageError("the camera sees nothing")
        return draw(shot, *rest)

    monkeypatch.setattr(story, "_draw", failing)
    results = run(job)
    assert next(results).frame == 1.0
    with pytest.raises(StageError, match="sees nothing"):
        next(results)


def test_a_frame_that_cannot_be_written_ends_the_job(job: RenderJob, monkeypatch: pytest.MonkeyPatch) -> None:
    write = story.write

    def failing(film, *rest):  # type: ignore[no-untyped-def]
        if film.frame == 2.0:
            raise OutputError("the disk is full")
        return write(film, *rest)

    monkeypatch.setattr(story, "write", failing)
    results = run(job)
    assert next(results).frame == 1.0
    with pytest.raises(OutputError, match="disk is full"):
        next(results)


def test_a_job_that_is_left_is_left_whole(job: RenderJob, tmp_path: Path) -> None:
    with Renderer() as renderer:
        results = run(job, renderer=renderer)
        next(results)
        results.close()
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def drawings(job: RenderJob, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many images `run` drew; it fills as they are."""
    drawn, draw = [], story._picture

    def counted(*given):  # type: ignore[no-untyped-def]
        drawn.append(1)
        return draw(*given)

    monkeypatch.setattr(story, "_picture", counted)
    return drawn


def test_a_stage_in_which_nothing_moves_is_drawn_once(job: RenderJob, monkeypatch: pytest.MonkeyPatch) -> None:
    """And its other frames hold what they hold when they are drawn alone."""
    counted = drawings(job, monkeypatch)
    paths = [path for result in run(job) for path in result.paths]
    assert len(counted) == 1
    assert [path.name for path in paths] == ["f.1.exr", "f.2.exr", "f.3.exr"]
    (alone,) = run(replace(job, frames=(2.0,), output=OutputSettings((str(paths[0].with_name("alone.exr")),))))
    np.testing.assert_array_equal(read(paths[1])["beauty"], read(alone.paths[0])["beauty"])


MOVING = STAGE.replace('ball" {}', 'ball" {\n double radius.timeSamples = { 1: 1, 3: 2 }\n}')


@pytest.mark.parametrize(
    ("text", "settings"),
    [
        (MOVING, RenderSettings(size=(16, 9))),
        (STAGE, RenderSettings(size=(16, 9), turntable=3)),
        (STAGE, RenderSettings(size=(16, 9), layers=("beauty", "motionForward"))),
    ],
)
def test_what_may_move_is_drawn_anew(
    text: str, settings: RenderSettings, job: RenderJob, monkeypatch: pytest.MonkeyPatch
) -> None:
    job.stage.write_text(text)
    counted = drawings(job, monkeypatch)
    assert len(list(run(replace(job, settings=settings)))) == len(counted) == 3


@pytest.mark.parametrize("layers", [("beauty",), ("beauty", "depth", "variance"), ("beauty", "crypto_object")])
def test_a_single_image_is_that_of_a_job_with_more(job: RenderJob, layers: tuple[str, ...]) -> None:
    """Its GBuffer is gone when it is read back; one sample and some, in tiles and whole, on a renderer used again."""
    for samples in (1, 3):
        asked = replace(job, settings=replace(job.settings, layers=layers, samples=samples), output=OutputSettings())
        first = next(run(asked)).images[0].film
        with Renderer(lone=True) as renderer:
            for _ in range(2):
                alone = next(run(replace(asked, frames=(1.0,)), renderer=renderer)).images[0].film
                assert first is not None and alone is not None
                for name in first.layers:
                    np.testing.assert_array_equal(alone.layers[name], first.layers[name])


BLINKING = """#usda 1.0
def Camera "cam" {
    float2 clippingRange = (1, 100)
    double shutter:open = 0
    double shutter:close = 0.5
    double3 xformOp:translate = (0, 0, 9)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Sphere "ball" {
    token visibility.timeSamples = { 1: "inherited", 2: "invisible", 2.25: "inherited" }
}
"""


@pytest.mark.parametrize("light", ["", 'def DistantLight "sun" {}\n', 'def DomeLight "sky" {}\n'])
@pytest.mark.parametrize("layout", ["float", "rgba8"])
def test_a_frame_in_which_all_is_hidden_is_drawn(tmp_path: Path, light: str, layout: Layout) -> None:
    (tmp_path / "a.usda").write_text(BLINKING + light)
    film = render(tmp_path / "a.usda", frame=2.0, size=(16, 9), layout=layout, background=False, shadows=False)
    assert not film.layers["beauty"].any()


def test_what_appears_while_the_shutter_is_open_is_lit(tmp_path: Path) -> None:
    """Nothing is there at the frame itself: half of its moments see the ball, at other places in the pixel."""
    (tmp_path / "a.usda").write_text(BLINKING + 'def DistantLight "sun" {}\n')
    films = (render(tmp_path / "a.usda", frame=frame, size=(16, 9), samples=32) for frame in (1.0, 2.0))
    shown, late = (film.layers["beauty"][4, 8] for film in films)
    assert shown.min() > 0.1
    np.testing.assert_allclose(late, 0.5 * shown, rtol=0.1)
