"""A thousand frames while everything goes wrong: workers die, the disk fills, stages are broken. `make farm-check`."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from defshade_cli.image.reading import read
from defshade_cli.resources import SCENES

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parent.parent
STAGES, FRAMES, BROKEN = 200, 5, (17, 81, 199)
TEXTURED = range(0, STAGES, 20)

STAGE = """#usda 1.0
( startTimeCode = 1
  endTimeCode = {frames} )
def Sphere "ball" {{
    double3 xformOp:translate.timeSamples = {{ 1: ({x}, 0, 0), {frames}: (0, 1, 0) }}
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel material:binding = </m>
}}
def DistantLight "sun" {{
}}
def Material "m" {{
    token outputs:surface.connect = </m/s.outputs:surface>
    def Shader "s" {{
        uniform token info:id = "UsdPreviewSurface"
        {color}
        token outputs:surface
    }}
}}
"""
TEXTURE = """color3f inputs:diffuseColor.connect = </m/t.outputs:rgb>
    }
    def Shader "t" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @../paint.png@
        float3 outputs:rgb"""


@pytest.fixture
def shots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """200 stages, of which 3 are broken and 10 read one texture."""
    (tmp_path / "shots").mkdir()
    for number in range(STAGES):
        color = TEXTURE if number in TEXTURED else f"color3f inputs:diffuseColor = (0.{number % 10}, 0.5, 0.2)"
        text = "#usda 1.0\ndef {" if number in BROKEN else STAGE.format(frames=FRAMES, x=number % 3, color=color)
        (tmp_path / "shots" / f"s{number:03}.usda").write_text(text)
    paint(tmp_path, 0.8)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    return tmp_path


def paint(folder: Path, value: float) -> None:
    oiio.ImageBuf(np.full((8, 8, 3), value, np.float32)).write(str(folder / "paint.png"), "uint8")


def batch(*options: str) -> subprocess.Popen[str]:
    stages = sorted(str(path) for path in Path("shots").glob("*.usda"))
    command = [sys.executable, "-m", "defshade_cli.cli", "batch", *stages, "--frames", f"1:{FRAMES}", "--size", "24x16"]
    command += ["--retries", "8", "--workers", "2", "--progress", "none", *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finished(*options: str) -> tuple[int, list[str], str]:
    """Exit code, the paths on stdout, and stderr."""
    process = batch(*options)
    stdout, stderr = process.communicate(timeout=1200)
    return process.returncode, stdout.split(), stderr


def children_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


@contextmanager
def small_disk(folder: Path) -> Iterator[Path]:
    """A file system of 16 MB; skips where this user may not mount one."""
    folder.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=16m", "tmpfs", folder], check=False).returncode:
        pytest.skip("a small file system cannot be mounted here")
    try:
        yield folder
    finally:
        subprocess.run(["umount", folder], check=True)


def workers_of(process: subprocess.Popen[str]) -> list[int]:
    return [int(child) for child in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()]


def disturb(process: subprocess.Popen[str], disk: Path) -> None:
    """Once 100 frames are there a worker is killed, and after 300 the disk is full for a second."""
    deadline = time.monotonic() + 900
    killed = False
    while process.poll() is None and time.monotonic() < deadline:
        count = len(list(disk.glob("*.exr")))
        if count > 100 and not killed:
            os.kill(workers_of(process)[0], signal.SIGKILL)
            killed = True
        if count > 300:
            filler = disk / "filler"
            with filler.open("wb") as file:
                file.truncate()
                try:
                    while file.write(b"x" * 65536):
                        file.flush()
                except OSError:
                    pass
            time.sleep(1.0)
            filler.unlink()
            return
        time.sleep(0.05)


def test_a_thousand_frames_while_everything_goes_wrong(shots: Path) -> None:
    with small_disk(shots / "disk") as disk:
        process = batch("-o", "disk/{scene}.#.exr")
        trouble = threading.Thread(target=disturb, args=(process, disk))
        trouble.start()
        _, stderr = process.communicate(timeout=1200)
        trouble.join()
        assert process.returncode == 6
        assert sorted(path.name for path in disk.iterdir()) == sorted(good_frames())
        for number in BROKEN:
            assert f"s{number:03}.usda" in stderr
        shutil.copytree(disk, shots / "disturbed")
    code, _, _ = finished("-o", "calm/{scene}.#.exr")
    assert code == 6
    for name in good_frames():
        a, b = read(shots / "disturbed" / name)["beauty"], read(shots / "calm" / name)["beauty"]
        np.testing.assert_array_equal(a, b)


def good_frames() -> list[str]:
    good = (number for number in range(STAGES) if number not in BROKEN)
    return [f"s{number:03}.{frame}.exr" for number in good for frame in range(1, FRAMES + 1)]


def test_a_second_run_renders_nothing_and_a_texture_its_own_frames(shots: Path) -> None:
    for number in BROKEN:
        Path("shots", f"s{number:03}.usda").unlink()
    code, made, _ = finished("-o", "out/{scene}.#.exr", "--existing", "skip")
    assert (code, len(made)) == (0, len(good_frames()))
    dates = {path: path.stat().st_mtime_ns for path in Path("out").iterdir()}
    start, before = time.perf_counter(), children_seconds()
    assert finished("-o", "out/{scene}.#.exr", "--existing", "skip")[0] == 0
    seconds, cpu = time.perf_counter() - start, children_seconds() - before
    print(f"skipped {len(made)} finished frames in {seconds:.1f} s, {cpu:.1f} processor seconds of three processes")
    assert {path: path.stat().st_mtime_ns for path in Path("out").iterdir()} == dates
    paint(shots, 0.3)
    assert finished("-o", "out/{scene}.#.exr", "--existing", "skip")[0] == 0
    touched = {path.name for path in Path("out").iterdir() if path.stat().st_mtime_ns != dates[path]}
    assert touched == {f"s{number:03}.{frame}.exr" for number in TEXTURED for frame in range(1, FRAMES + 1)}


def test_forty_frames_four_ways(shots: Path) -> None:
    """render, batch, Dask and Open Job Description, to the bit."""
    openjd = shutil.which("openjd") or shutil.which("openjd", path=str(Path(sys.executable).parent))
    if openjd is None:
        pytest.skip("the openjd command is not installed")
    shutil.copy(SCENES / "animated.usda", shots)
    frames = ["animated.usda", "--frames", "1:40", "--size", "48x27", "--samples", "2"]
    program = [sys.executable, "-m", "defshade_cli.cli"]
    for folder, command in (
        ("render", ["render", *frames]),
        ("batch", ["batch", *frames, "--workers", "2"]),
        ("dask", ["batch", *frames, "--engine", "dask", "--workers", "2"]),
    ):
        subprocess.run([*program, *command, "-o", f"{folder}/#.exr"], check=True, capture_output=True, timeout=600)
    emitted = [*program, "batch", *frames, "-o", "openjd/#.exr", "--emit", "openjd"]
    Path("job.yaml").write_text(subprocess.run(emitted, check=True, capture_output=True, text=True).stdout)
    wrapper = shots / "defshade"
    wrapper.write_text(f'#!/bin/sh\nexec {sys.executable} -m defshade_cli.cli "$@"\n')
    wrapper.chmod(0o755)
    run = [openjd, "run", "job.yaml", "--step", "Render1", "-p", f"Folder={shots}", "-p", f"Defshade={wrapper}"]
    subprocess.run(run, check=True, capture_output=True, timeout=600)
    ways = ("render", "batch", "dask", "openjd")
    for number in range(1, 41):
        first, *others = (read(Path(folder, f"{number}.exr"))["beauty"] for folder in ways)
        for other in others:
            np.testing.assert_array_equal(first, other)
