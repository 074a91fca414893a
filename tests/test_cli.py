"""The command line as a user meets it, judged by exit code, stdout, stderr and files.

What is refused before any driver is loaded runs in this process, all else in one of its own.
"""

from __future__ import annotations

import io
import json
import logging
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from unittest.mock import patch

import pytest

from defshade_cli import __version__
from defshade_cli.cli import main

TRIANGLE = """#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 3
    metersPerUnit = 1
    upAxis = "Y"
)

def Mesh "Triangle"
{
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(-1, -1, 0), (1, -1, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
}

def Camera "Eye"
{
    double3 xformOp:translate = (0, 0, 10)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}

def DistantLight "Sun"
{
    float inputs:intensity = 1
    float inputs:angle = 0
}

def SphereLight "Dark"
{
    float inputs:intensity = 0
}
"""
EMPTY = '#usda 1.0\n\ndef Camera "Eye"\n{\n}\n'
SMALL = ("--size", "16x8")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder with two stages in `stages/`."""
    (tmp_path / "stages").mkdir()
    (tmp_path / "stages" / "triangle.usda").write_text(TRIANGLE)
    (tmp_path / "stages" / "empty.usda").write_text(EMPTY)
    (tmp_path / "stages" / "noise.usda").write_bytes(bytes(range(256)))
    (tmp_path / "stages" / "picture.png").write_bytes(b"not a stage")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def defshade(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "defshade_cli.cli", *arguments]
    path = os.pathsep.join([str(Path(__file__).resolve().parent.parent), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        command, capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": path, **environment}
    )


@pytest.fixture
def package_log() -> Iterator[None]:
    """The package's logger as it was, afterwards."""
    logger = logging.getLogger("defshade")
    handlers, level = logger.handlers, logger.level
    yield
    logger.handlers = handlers
    logger.setLevel(level)


def defshade_here(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The same in this process."""
    with (
        patch.object(sys, "argv", ["defshade", *arguments]),
        redirect_stdout(io.StringIO()) as stdout,
        redirect_stderr(io.StringIO()) as stderr,
        pytest.raises(SystemExit) as leaving,
    ):
        main()
    code = leaving.value.code
    assert isinstance(code, int)
    return subprocess.CompletedProcess(arguments, code, stdout.getvalue(), stderr.getvalue())


def succeed(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    done = defshade(*arguments, **environment)
    assert done.returncode == 0, done.stderr
    return done


def files(folder: Path) -> set[str]:
    found = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    return {name for name in found if not name.startswith("stages")}


def assert_refused(done: subprocess.CompletedProcess[str], exit_code: int, mention: str) -> None:
    """One sentence on stderr that names the culprit, nothing on stdout, and the right exit code."""
    assert done.returncode == exit_code, done.stderr
    lines = done.stderr.strip().splitlines()
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("defshade: error: ")
    assert mention in lines[0]
    assert not done.stdout


@pytest.mark.parametrize("arguments", [["--help"], ["render", "--help"], ["gbuffer", "--help"], ["--version"]])
def test_help_loads_no_foreign_library(arguments: list[str]) -> None:
    code = (
        "import sys, atexit\n"
        f"sys.argv = ['defshade', *{arguments}]\n"
        "heavy = {'pxr', 'moderngl', 'OpenImageIO', 'numpy', 'scipy', 'colour', 'rich'}\n"
        "atexit.register(lambda: print('loaded:', sorted(heavy & sys.modules.keys())))\n"
        "from defshade_cli.cli import main\n"
        "main()\n"
    )
    root = Path(__file__).resolve().parent.parent
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=root)
    assert done.stdout.strip().endswith("loaded: []")


def test_version() -> None:
    assert succeed("--version").stdout.split()[-1] == __version__


@pytest.mark.parametrize(
    ("exit_code", "mention", "arguments"),
    [
        pytest.param(2, "--sample", ["render", "s.usda", "--sample", "4"], id="unknown option"),
        pytest.param(2, "paint", ["paint", "s.usda"], id="unknown command"),
        pytest.param(2, "'render'", ["rneder", "s.usda"], id="command suggested"),
        pytest.param(2, "SCENE", ["render"], id="no scene"),
        pytest.param(2, "depht", ["render", "s.usda", "--layers", "beauty,depht"], id="unknown layer"),
        pytest.param(2, "'depth'", ["render", "s.usda", "--layers", "beauty,depht"], id="layer suggested"),
        pytest.param(2, "--width", ["render", "s.usda", "--size", "8x8", "--width", "8"], id="size and width"),
        pytest.param(2, "--default-time", ["render", "s.usda", "--frames", "1", "--default-time"], id="two times"),
        pytest.param(2, "--frames", ["render", "s.usda", "--frames", "one"], id="frames that are not"),
        pytest.param(2, "1-10:2", ["render", "s.usda", "--frames", "1-10:2"], id="frames with two meanings"),
        pytest.param(2, "1920", ["render", "s.usda", "--size", "1920"], id="size without height"),
        pytest.param(2, "0x8", ["render", "s.usda", "--size", "0x8"], id="size of nothing"),
        pytest.param(2, "nan", ["render", "s.usda", "--exposure", "nan"], id="exposure that is not a number"),
        pytest.param(2, "0", ["render", "s.usda", "--samples", "0"], id="no samples"),
        pytest.param(2, "whole number", ["render", "s.usda", "--samples", "four"], id="samples in words"),
        pytest.param(2, "proxies", ["render", "s.usda", "--purposes", "proxies"], id="unknown purpose"),
        pytest.param(3, "missing.usda", ["render", "missing.usda"], id="no such stage"),
        pytest.param(3, "missing.usda", ["inspect", "missing.usda"], id="no such stage to inspect"),
        pytest.param(3, "picture.png", ["render", "stages/picture.png"], id="not USD at all"),
        pytest.param(3, "stages", ["render", "stages"], id="a folder"),
        pytest.param(3, "Ear", ["render", "stages/triangle.usda", "--camera", "Ear"], id="unknown camera"),
        pytest.param(3, "/Triangle", ["render", "stages/triangle.usda", "--camera", "/Triangle"], id="not a camera"),
        pytest.param(
            2, "out.exr", ["render", "stages/triangle.usda", "--frames", "1:3", "-o", "out.exr"], id="no token"
        ),
        pytest.param(2, ".xyz", ["render", "stages/triangle.usda", "-o", "out.xyz"], id="unknown format"),
        pytest.param(2, "ends with its format", ["render", "stages/triangle.usda", "-o", "out"], id="no format"),
        pytest.param(2, "Radio", ["render", "stages/triangle.usda", "--display", "Radio"], id="display for no picture"),
        pytest.param(
            5,
            "stats.json",
            ["render", "stages/triangle.usda", "--stats", "stages/triangle.usda/stats.json"],
            id="stats",
        ),
        pytest.param(2, "rsme", ["compare", "a.exr", "b.exr", "--threshold", "rsme=1"], id="unknown metric"),
        pytest.param(5, "missing.exr", ["compare", "missing.exr", "missing.exr"], id="nothing to compare"),
    ],
)
@pytest.mark.usefixtures("package_log")
def test_wrong_use_is_refused(folder: Path, exit_code: int, mention: str, arguments: list[str]) -> None:
    assert_refused(defshade_here(*arguments), exit_code, mention)
    assert not files(folder)


def test_stage_without_geometry_is_refused(folder: Path) -> None:
    assert_refused(defshade("render", "stages/empty.usda"), 3, "empty")
    assert not files(folder)


def test_file_that_is_not_usd_is_refused(folder: Path) -> None:
    """In a process of its own, for what the parser itself prints."""
    assert_refused(defshade("render", "stages/noise.usda"), 3, "noise.usda")
    assert not files(folder)


@pytest.mark.usefixtures("package_log")
def test_interruption_has_its_exit_code() -> None:
    with patch("defshade_cli.rendering.run", side_effect=KeyboardInterrupt):
        done = defshade_here("render", "stages/triangle.usda")
    assert (done.returncode, done.stderr.strip()) == (130, "defshade: error: interrupted")


@pytest.mark.usefixtures("package_log")
def test_a_bug_keeps_its_traceback() -> None:
    with patch("defshade_cli.rendering.run", side_effect=ZeroDivisionError), pytest.raises(ZeroDivisionError):
        defshade_here("render", "stages/triangle.usda")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no device that is always full")
@pytest.mark.parametrize("arguments", [["--version"], ["inspect", "stages/triangle.usda"]])
def test_results_that_nobody_can_take_are_an_error(folder: Path, arguments: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "defshade_cli.cli", *arguments]
        ended = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert ended.returncode == 5
    assert ended.stderr.startswith("defshade: error: ") and ended.stderr.count("\n") == 1


def test_unknown_display_is_refused(folder: Path) -> None:
    done = defshade("render", "stages/triangle.usda", *SMALL, "-o", "out.png", "--display", "Radio")
    assert_refused(done, 2, "Radio")
    assert not files(folder)


def test_output_under_a_file_is_refused(folder: Path) -> None:
    """Root may write anywhere, so the folder of the output is a file here."""
    Path("plain").write_text("a file")
    done = defshade("render", "stages/triangle.usda", *SMALL, "-o", "plain/out.exr")
    assert_refused(done, 5, "plain")
    assert files(folder) == {"plain"}


def test_existing_file_is_kept_when_asked(folder: Path) -> None:
    Path("triangle.exr").write_text("precious")
    assert_refused(defshade("render", "stages/triangle.usda", *SMALL, "--existing", "error"), 5, "triangle.exr")
    assert Path("triangle.exr").read_text() == "precious"


NO_GL = {
    "no libEGL": {"DEFSHADE_LIBEGL": "libEGL-that-is-not-installed.so.1"},
    "no driver": {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent.json"},
}


@pytest.mark.parametrize("environment", NO_GL.values(), ids=NO_GL.keys())
def test_without_egl_a_render_says_what_to_install(folder: Path, environment: dict[str, str]) -> None:
    done = defshade("render", "stages/triangle.usda", *SMALL, **environment)
    assert_refused(done, 4, "libegl1 libgl1 libgl1-mesa-dri")
    assert not files(folder)


@pytest.mark.parametrize("environment", NO_GL.values(), ids=NO_GL.keys())
def test_without_egl_the_doctor_says_what_to_install(environment: dict[str, str]) -> None:
    done = defshade("doctor", **environment)
    assert done.returncode == 4
    assert "apt-get install" in done.stderr
    assert "libegl1 libgl1 libgl1-mesa-dri" in done.stderr
    assert "Traceback" not in done.stderr


def test_inspect_needs_no_egl() -> None:
    succeed("inspect", "stages/triangle.usda", **NO_GL["no libEGL"])


def test_doctor_finds_a_device() -> None:
    done = succeed("doctor")
    assert re.search(r"device 0 .*OpenGL", done.stdout)
    assert __version__ in done.stdout


def test_render_writes_what_it_prints(folder: Path) -> None:
    done = succeed("render", "stages/triangle.usda", *SMALL, "-o", "out/{scene}.exr", "-o", "out/{scene}.png")
    assert files(folder) == {"out/triangle.exr", "out/triangle.png"}
    assert done.stdout.split() == ["out/triangle.exr", "out/triangle.png"]
    assert re.fullmatch(r"frame 1  → out/triangle.exr, out/triangle.png  \d+\.\d\d s\n", done.stderr)


def test_quiet_leaves_only_results() -> None:
    done = succeed("render", "stages/triangle.usda", *SMALL, "--quiet")
    assert done.stdout.split() == ["triangle.exr"]
    assert not done.stderr


def test_several_frames_are_numbered_by_default(folder: Path) -> None:
    succeed("gbuffer", "stages/triangle.usda", *SMALL, "--frames", "1:3x2", "--quiet")
    assert files(folder) == {"triangle.gbuffer.0001.exr", "triangle.gbuffer.0003.exr"}


def test_skip_renders_only_what_is_missing(folder: Path) -> None:
    arguments = ("gbuffer", "stages/triangle.usda", *SMALL, "--existing", "skip")
    succeed(*arguments, "--frames", "2", "-o", "f.####.exr")
    before = (folder / "f.0002.exr").stat().st_mtime_ns
    done = succeed(*arguments, "--frames", "1:2", "-o", "f.####.exr")
    assert files(folder) == {"f.0001.exr", "f.0002.exr"}
    assert (folder / "f.0002.exr").stat().st_mtime_ns == before
    assert "frame 2  → f.0002.exr  skipped" in done.stderr


@pytest.mark.usefixtures("package_log")
def test_a_failure_is_told_to_the_farm() -> None:
    done = defshade_here("render", "missing.usda", "--progress", "openjd")
    assert done.returncode == 3
    assert any(line.startswith("openjd_fail: ") for line in done.stderr.splitlines())


def test_stats_record_what_was_done() -> None:
    succeed("render", "stages/triangle.usda", *SMALL, "--layers", "beauty,depth", "--stats", "stats.json", "--quiet")
    record = json.loads(Path("stats.json").read_text())
    frame = record["frames"][0]
    assert record["version"] == __version__
    assert record["job"]["settings"]["size"] == [16, 8]
    assert {"read", "draw", "write"} <= frame["seconds"].keys()
    (image,) = frame["images"]
    assert image["paths"] == ["triangle.exr"]
    assert image["decisions"]
    assert image["layers"]["depth"]["min"] == pytest.approx([10.0], rel=1e-5)
    assert 0.0 < image["layers"]["depth"]["finite"] < 1.0


def test_inspect_shows_what_is_there() -> None:
    shown = succeed("inspect", "stages/triangle.usda", "--plan").stdout
    assert "/Eye  ← selected" in shown
    assert "/Sun  distant → quad" in shown
    assert "/Dark  sphere, gives no light" in shown
    assert "triangles: 1" in shown


def test_inspect_times_the_steps_of_a_frame() -> None:
    record = json.loads(succeed("inspect", "stages/triangle.usda", "--timing", "--json", *SMALL).stdout)
    assert list(record["seconds"]) == ["open", "read", "plan", "context", "upload", "draw"]
    assert all(seconds >= 0.0 for seconds in record["seconds"].values())


def test_inspect_as_json() -> None:
    record = json.loads(succeed("inspect", "stages/triangle.usda", "--json", *SMALL).stdout)
    assert record["camera"] == "/Eye"
    assert record["geometry"] == {"meshes": 1, "instances": 1, "triangles": 1}
    assert record["lights"][0] == {"path": "/Sun", "kind": "distant", "volume": "quad", "reach": None}
    assert record["plan"]["size"] == [16, 8]


def test_compare_ends_with_one_over_the_threshold() -> None:
    for name, stops in (("a.exr", "0"), ("b.exr", "1")):
        succeed("render", "stages/triangle.usda", *SMALL, "--exposure", stops, "-o", name, "--quiet")
    assert succeed("compare", "a.exr", "a.exr", "--threshold", "0").stdout
    different = defshade("compare", "a.exr", "b.exr", "--threshold", "1e-4")
    assert different.returncode == 1
    assert "Traceback" not in different.stderr
    assert "beauty: rmse" in different.stderr
    record = json.loads(succeed("compare", "a.exr", "b.exr", "--json").stdout)
    assert [layer["layer"] for layer in record["layers"]] == ["beauty"]
    assert record["layers"][0]["rmse"] > 1e-4


def test_compare_writes_the_difference(folder: Path) -> None:
    succeed("render", "stages/triangle.usda", *SMALL, "--layers", "beauty,depth", "-o", "a.exr", "--quiet")
    succeed("compare", "a.exr", "a.exr", "--diff", "d.exr", "--threshold", "0")
    same = json.loads(succeed("compare", "d.exr", "d.exr", "--json").stdout)
    assert [layer["layer"] for layer in same["layers"]] == ["beauty", "depth"]
    assert json.loads(succeed("compare", "d.exr", "a.exr", "--json").stdout)["layers"][1]["unmatched"] > 0


def test_the_same_in_python() -> None:
    code = (
        "from defshade_cli import render\n"
        "film = render('stages/triangle.usda', size=(16, 8), layers=('beauty', 'depth'))\n"
        "print(film.layers['depth'].shape, film.camera.path)"
    )
    path = str(Path(__file__).resolve().parent.parent)
    environment = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.strip() == "(8, 16, 1) /Eye"
