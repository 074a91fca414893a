"""--existing skip: a frame is finished when its file says that it was made of the same."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from defshade_cli.farm.fingerprint import Fingerprint
from defshade_cli.farm.open_job import OpenJob
from defshade_cli.farm.targets import FINGERPRINT
from defshade_cli.image.files import remove_abandoned, write
from defshade_cli.image.reading import read_header
from defshade_cli.rendering import Renderer, run
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings
from films import film

PART = '#usda 1.0\n(defaultPrim = "Ball")\ndef Sphere "Ball"\n{\n    double radius = 1\n}\n'
SHOT = """#usda 1.0
def "Ball" ( references = @parts/ball.usda@ ) {}
def Shader "Image"
{
    asset inputs:file = @parts/paint.png@
}
"""
PLAIN = '#usda 1.0\ndef Sphere "Ball" {}\n'


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a stage that depends on a layer and an image, and one that does not."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "ball.usda").write_text(PART)
    (tmp_path / "parts" / "paint.png").write_bytes(b"red")
    (tmp_path / "shot.usda").write_text(SHOT)
    (tmp_path / "plain.usda").write_text(PLAIN)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with Renderer() as renderer:
        yield renderer


JOB = RenderJob(
    Path("shot.usda"),
    (1.0, 2.0),
    settings=RenderSettings(size=(16, 9)),
    output=OutputSettings(("out/{scene}.#.exr", "out/{scene}.#.png"), existing="skip"),
)


def fingerprint(job: RenderJob, frame: float | None = 1.0) -> str:
    return Fingerprint(job).of(frame)


def rendered(job: RenderJob, renderer: Renderer) -> list[float | None]:
    """The frames that were not skipped."""
    return [result.frame for result in run(job, renderer=renderer) if not result.skipped]


@pytest.mark.parametrize(
    "change",
    [
        lambda: Path("parts/ball.usda").write_text(PART.replace("= 1", "= 2")),
        lambda: Path("parts/paint.png").write_bytes(b"tan"),
        lambda: Path("parts/paint.png").unlink(),
        lambda: Path("shot.usda").write_text(SHOT + "\n"),
    ],
    ids=["layer", "image", "missing image", "root layer"],
)
def test_a_change_of_any_file_changes_the_fingerprint(change: Callable[[], object]) -> None:
    before = fingerprint(JOB), fingerprint(replace(JOB, stage=Path("plain.usda")))
    change()
    after = fingerprint(JOB), fingerprint(replace(JOB, stage=Path("plain.usda")))
    assert after[0] != before[0] and after[1] == before[1]


def test_settings_that_reach_the_file_count_and_others_do_not() -> None:
    same = [
        replace(JOB, device=1, frames=()),
        replace(JOB, output=replace(JOB.output, patterns=("x.exr",), existing="error")),
    ]
    other = [
        replace(JOB, camera="/Camera"),
        replace(JOB, settings=replace(JOB.settings, samples=2)),
        replace(JOB, output=replace(JOB.output, full_float=True)),
    ]
    assert {fingerprint(job) for job in same} == {fingerprint(JOB)}
    assert len({fingerprint(JOB), fingerprint(JOB, 2.0), fingerprint(JOB, None), *map(fingerprint, other)}) == 6


def test_a_copied_folder_with_new_dates_is_the_same(folder: Path) -> None:
    before = fingerprint(JOB)
    shutil.copytree(folder, folder / "copy", copy_function=shutil.copyfile)
    assert fingerprint(replace(JOB, stage=Path("copy/shot.usda"))) == before


def test_only_stale_frames_are_rendered_again(renderer: Renderer) -> None:
    plain = replace(JOB, stage=Path("plain.usda"))
    assert rendered(JOB, renderer) == rendered(plain, renderer) == [1.0, 2.0]
    opened = OpenJob(JOB)
    assert read_header(Path("out/shot.1.png"))[FINGERPRINT] == opened.fingerprint(*opened.shots(1.0))
    assert not rendered(JOB, renderer)
    Path("parts/paint.png").write_bytes(b"tan")
    assert rendered(JOB, renderer) == [1.0, 2.0]
    assert not rendered(plain, renderer)


@pytest.mark.parametrize("harm", [Path.unlink, lambda path: path.write_bytes(b"")], ids=["gone", "cut off"])
def test_a_frame_that_lacks_a_file_is_rendered_again(renderer: Renderer, harm: Callable[[Path], object]) -> None:
    rendered(JOB, renderer)
    harm(Path("out/shot.2.png"))
    assert rendered(JOB, renderer) == [2.0]


def test_a_stage_with_an_unreadable_part_is_rendered_and_never_finished(renderer: Renderer) -> None:
    """What it depends on cannot be known."""
    Path("broken.usda").write_text("#usda 1.0\ndef {")
    Path("plain.usda").write_text(PLAIN + 'def "Lost" ( references = @broken.usda@ ) {}\n')
    plain = replace(JOB, stage=Path("plain.usda"))
    assert rendered(plain, renderer) == rendered(plain, renderer) == [1.0, 2.0]


def test_a_thousand_finished_frames_are_skipped_in_seconds(renderer: Renderer) -> None:
    job = replace(JOB, frames=tuple(map(float, range(1, 1001))), output=OutputSettings(("o/#.exr",), existing="skip"))
    opened = OpenJob(job)
    for frame in job.frames:
        (shot,) = opened.shots(frame)
        made = film("beauty", size=(16, 9), metadata={FINGERPRINT: opened.fingerprint(shot)})
        write(made, job.output, Path(f"o/{frame:.0f}.exr"))
    start = time.perf_counter()
    assert not rendered(job, renderer)
    assert time.perf_counter() - start < 5.0


def test_leftovers_of_dead_writers_are_removed_and_no_others(folder: Path) -> None:
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    here = socket.gethostname()
    ours, theirs, living = (
        folder / name
        for name in (f".{here}-{dead.pid}-7f.exr", f".other.{here}-{dead.pid}-7f.exr", f".{here}-{os.getpid()}-7f.exr")
    )
    for path in (ours, theirs, living):
        path.touch()
    remove_abandoned(folder)
    assert [path.exists() for path in (ours, theirs, living)] == [False, True, True]
