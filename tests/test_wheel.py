"""What is built to be installed elsewhere: it renders where no repository is."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tarfile
import venv
from pathlib import Path

import pytest

from defshade_cli.image.reading import read

ROOT = Path(__file__).resolve().parent.parent
ELSEWHERE = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}

STAGE = """#usda 1.0
def Sphere "Ball" {}
def DistantLight "Sun" {}
"""


def run(*command: str | Path, folder: Path) -> str:
    return subprocess.run(command, cwd=folder, env=ELSEWHERE, check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the sdist, and the wheel that is built from it."""
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT, folder=folder)
    return folder


@pytest.fixture(scope="module")
def program(dist: Path) -> Path:
    """`defshade` of an environment that has the wheel; what it depends on is lent by the one of the tests."""
    venv.create(dist / "env", with_pip=False)
    (wheel,) = dist.glob("*.whl")
    python = dist / "env" / "bin" / "python"
    pip = ("-m", "pip", "--python", python, "install", "--quiet", "--no-deps", "--no-index", "--no-compile", wheel)
    run(sys.executable, *pip, folder=dist)
    (packages,) = (dist / "env" / "lib").glob("python*/site-packages")
    (packages / "lent.pth").write_text(f"{sysconfig.get_path('purelib')}\n")
    return python.with_name("defshade")


def test_the_wheel_renders_where_no_repository_is(program: Path, tmp_path: Path) -> None:
    (tmp_path / "ball.usda").write_text(STAGE)
    small = ("--size", "32x18", "--layers", "beauty,depth", "--quiet")
    assert run(program, "render", "ball.usda", *small, folder=tmp_path) == "ball.exr\n"
    assert set(read(tmp_path / "ball.exr")) == {"beauty", "depth"}
    run(program, "view", "ball.exr", "--html", "ball.html", folder=tmp_path)
    assert "<canvas" in (tmp_path / "ball.html").read_text()


def test_the_sdist_has_what_the_tests_need_and_nothing_built(dist: Path) -> None:
    (sdist,) = dist.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        tops = {name.split("/")[1] for name in archive.getnames()}
    assert {"Makefile", "tests", "scenes", "shaders", "docs", "LICENSE"} <= tops
    assert not tops & {".git", ".venv", "out", "dist", "build"}
