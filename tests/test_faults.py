"""What becomes of renders that are ended, killed, contained or in each other's way: whole files, or none."""

from __future__ import annotations

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from defshade_cli.farm.limits import Limits
from defshade_cli.image.reading import read
from defshade_cli.rendering import run
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

ROOT = Path(__file__).resolve().parent.parent
STAGE = ROOT / "scenes" / "animated.usda"
SMALL = ("--size", "48x27")
KILLS = int(os.environ.get("DEFSHADE_KILLS", "3"))
"""`make kill-check` asks for 200."""
KILLED_FRAMES = 20


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def start(*arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "defshade_cli.cli", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=environment)


def finish(*arguments: str) -> tuple[int, str]:
    """Exit code and stderr."""
    process = start(*arguments)
    _, said = process.communicate(timeout=120)
    return process.returncode, said


def wait_for(folder: Path, pattern: str) -> None:
    end = time.monotonic() + 60
    while not list(folder.glob(pattern)):
        assert time.monotonic() < end, f"no {pattern}"
        time.sleep(0.02)


def assert_whole(folder: Path) -> None:
    """Every file is named as it was asked, and can be read to its end."""
    for path in folder.iterdir():
        assert re.fullmatch(r"\d+\.exr", path.name), path
        assert np.isfinite(read(path)["beauty"]).all()


@pytest.mark.parametrize(("ending", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_ended_render_leaves_whole_files(folder: Path, ending: int, status: int) -> None:
    process = start("render", str(STAGE), "--frames", "1:900", *SMALL, "-o", "out/#.exr")
    wait_for(folder, "out/[0-9]*.exr")
    process.send_signal(ending)
    process.communicate(timeout=60)
    assert process.returncode == status
    assert_whole(folder / "out")


def test_killed_renders_leave_whole_files_and_a_rerun_completes_them(folder: Path) -> None:
    """SIGKILL at random moments of a render whose frames all differ: each file that stands is that of the whole run.

    What one killed run leaves the next goes on with, until the set is complete and another is begun.
    """
    asked = ("render", str(STAGE), "--frames", f"1:{KILLED_FRAMES}", *SMALL, "--existing", "skip")
    began = time.monotonic()
    assert finish(*asked, "-o", "whole/#.exr")[0] == 0
    took = time.monotonic() - began
    whole = {path.name: read(path)["beauty"] for path in (folder / "whole").iterdir()}
    assert len({image.tobytes() for image in whole.values()}) == KILLED_FRAMES
    moments, found = random.Random(7), set[str]()
    for _ in range(KILLS):
        if len(found) == KILLED_FRAMES:
            shutil.rmtree(folder / "out")
        process = start(*asked, "-o", "out/#.exr")
        time.sleep(moments.uniform(0.0, took))
        process.kill()
        process.communicate()
        found = assert_part_of(whole, folder / "out")
    assert finish(*asked, "-o", "out/#.exr")[0] == 0
    assert assert_part_of(whole, folder / "out") == whole.keys()
    assert_whole(folder / "out")


def assert_part_of(whole: dict[str, np.ndarray], folder: Path) -> set[str]:
    """The names of the images that stand in the folder, each of which is bit for bit that of the whole set."""
    found = {path.name: read(path)["beauty"] for path in folder.glob("[0-9]*.exr")}
    for name, image in found.items():
        np.testing.assert_array_equal(image, whole[name])
    return set(found)


def test_two_processes_may_write_the_same_frame(folder: Path) -> None:
    both = [start("render", str(STAGE), "--frames", "1:3", *SMALL, "-o", "out/#.exr") for _ in range(2)]
    assert [process.wait(120) for process in both] == [0, 0]
    assert_whole(folder / "out")
    for process in both:
        process.communicate()


def test_a_folder_that_vanishes_is_made_again(folder: Path) -> None:
    output = OutputSettings((str(folder / "out" / "#.exr"),))
    results = run(RenderJob(STAGE, (1.0, 2.0, 3.0), settings=RenderSettings(size=(16, 9)), output=output))
    for path in next(results).paths:
        path.unlink()
    (folder / "out").rename(folder / "elsewhere")
    assert all(path.exists() for result in results for path in result.paths if result.frame == 3.0)


def test_a_texture_that_is_deleted_between_frames_costs_only_itself(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    for name in ("texture_cards.usda", "textures", "parts"):
        source = ROOT / "scenes" / name
        (shutil.copytree if source.is_dir() else shutil.copy)(source, folder / name)
    results = run(RenderJob(folder / "texture_cards.usda", (1.0, 2.0, 3.0), settings=RenderSettings(size=(16, 9))))
    next(results)
    shutil.rmtree(folder / "textures")
    assert [result.frame for result in results] == [2.0, 3.0]


def test_what_is_isolated_is_the_same(folder: Path) -> None:
    for name, extra in (("plain", ()), ("apart", ("--isolate",))):
        assert finish("render", str(STAGE), *SMALL, *extra, "-o", f"{name}.exr")[0] == 0
    np.testing.assert_array_equal(read(folder / "plain.exr")["beauty"], read(folder / "apart.exr")["beauty"])


def test_an_error_keeps_its_exit_code_in_a_process_of_its_own() -> None:
    status, said = finish("render", "nowhere.usda", "--isolate")
    assert status == 3
    assert "defshade: error: no such file: nowhere.usda" in said


def test_memory_has_a_ceiling() -> None:
    status, said = finish("render", str(STAGE), *SMALL, "--memory-limit", "20")
    assert status == 6
    assert "it took more than 20 MiB of memory" in said


def test_a_stage_that_never_opens_has_its_time(folder: Path) -> None:
    """The stage is a pipe that nobody writes to."""
    os.mkfifo(folder / "trap.usda")
    status, said = finish("render", "trap.usda", "--timeout", "4")
    assert status == 6
    assert "it took more than 4 s" in said


def test_a_process_that_has_ended_takes_no_memory() -> None:
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    assert Limits(memory=1).passed_by(process.pid, time.monotonic()) == ""
    assert not Limits()
