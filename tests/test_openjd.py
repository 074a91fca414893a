"""Batches as Open Job Description: run with the real `openjd` command where it is installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from defshade_cli.cli.batch import batch
from defshade_cli.errors import UsageError
from defshade_cli.farm.frames import parse_frames
from defshade_cli.farm.openjd import range_expression
from defshade_cli.image.reading import read
from defshade_cli.resources import SCENES

ROOT = Path(__file__).resolve().parent.parent
OPENJD = shutil.which("openjd") or shutil.which("openjd", path=str(Path(sys.executable).parent))


def emit(*arguments: str) -> str:
    done = CliRunner().invoke(batch, [*arguments, "--emit", "openjd"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.stdout


@given(st.sets(st.integers(-500, 500), min_size=1, max_size=40))
def test_range_expressions_name_the_same_frames_when_read_back(frames: set[int]) -> None:
    assert parse_frames(f"openjd:{range_expression(frames)}") == tuple(sorted(frames))


@pytest.mark.parametrize(
    ("text", "frames"),
    [("7", [7]), ("1-4", [1, 2, 3, 4]), ("1-10:4,15", [1, 5, 9, 15]), ("-3--1", [-3, -2, -1]), ("3-1:-1", [3, 2, 1])],
)
def test_openjd_ranges_have_their_own_meaning(text: str, frames: list[float]) -> None:
    assert parse_frames(f"openjd:{text}") == tuple(frames)


@pytest.mark.parametrize("text", ["1:10", "1-10x2", "1.5", "", "1-10:0"])
def test_what_openjd_does_not_write_is_refused(text: str) -> None:
    with pytest.raises(UsageError):
        parse_frames(f"openjd:{text}")


def test_parts_of_frames_are_refused() -> None:
    with pytest.raises(UsageError, match=r"frame 1\.5: Open Job Description has whole frames only"):
        range_expression([1.0, 1.5])


def test_stages_with_the_same_frames_and_options_share_a_step(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text("stages: [c.usda]\nsettings: {samples: 4}\n")
    text = emit("a.usda", "b.usda", str(tmp_path / "job.yaml"), "--frames", "1:9x2", "--existing", "skip")
    template = yaml.safe_load(text)
    first, second = template["steps"]
    stages, frames = first["parameterSpace"]["taskParameterDefinitions"]
    assert stages["range"] == ["a.usda", "b.usda"] and frames["range"] == "1-9:2"
    assert "--samples" in second["script"]["actions"]["onRun"]["args"]
    assert first["script"]["actions"]["onRun"]["args"][4:6] == ["--existing", "skip"]
    assert "&id" not in text


@pytest.mark.skipif(OPENJD is None, reason="the openjd command is not installed: pip install 'defshade[farm]'")
@pytest.mark.parametrize(
    "options", [("--frames", "1:5x2,8"), ("--default-time",), ()], ids=["frames", "default", "first"]
)
def test_openjd_renders_what_batch_renders(tmp_path: Path, options: tuple[str, ...]) -> None:
    """Two stages, with options whose values could be taken for others."""
    for name in ("animated", "gprims"):
        shutil.copy(SCENES / f"{name}.usda", tmp_path)
    name = "{scene}.####.exr" if "--frames" in options else "{scene}.exr"
    shared = ("animated.usda", "gprims.usda", *options, "--size", "48x27", "--samples", "2", "--exposure", "-0.5")
    (tmp_path / "job.yaml").write_text(emit(*shared, "--no-shadows", "--layers", "beauty,depth", "-o", f"farm/{name}"))
    program = tmp_path / "program"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m defshade_cli.cli "$@"\n')
    program.chmod(0o755)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    farm = [str(OPENJD), "run", "job.yaml", "-p", f"Defshade={program}", "-p", "ChunkFrames=2"]
    alone = [str(program), "batch", *shared, "--no-shadows", "--layers", "beauty,depth", "-o", f"alone/{name}", "-q"]
    for command in (farm, alone):
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    ours, theirs = (sorted(path.name for path in (tmp_path / folder).iterdir()) for folder in ("farm", "alone"))
    assert ours == theirs and len(ours) == (8 if "--frames" in options else 2)
    for file in ours:
        a, b = read(tmp_path / "farm" / file), read(tmp_path / "alone" / file)
        assert all(np.array_equal(a[layer], b[layer]) for layer in a), file
