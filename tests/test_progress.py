"""What each way of telling progress prints, and where."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from defshade_cli.cli.options import Reporting
from defshade_cli.cli.progress import Progress, frame_name, make_progress
from defshade_cli.errors import StageError
from defshade_cli.rendering import FrameResult, ImageResult

PROTOCOLS = {
    "alf": ["ALF_PROGRESS 0%", "ALF_PROGRESS 33%", "ALF_PROGRESS 66%", "ALF_PROGRESS 100%"],
    "openjd": [
        "openjd_progress: 0.0",
        "openjd_progress: 33.3",
        "openjd_status: frame 1, 1 of 3",
        "openjd_progress: 66.7",
        "openjd_status: frame 2, 2 of 3",
        "openjd_progress: 100.0",
        "openjd_status: frame 3, 3 of 3",
    ],
    "auto": [f"frame {frame}  → f.{frame}.exr  0.75 s" for frame in (1, 2, 3)],
    "none": [],
}


def _result(frame: float, **fields: bool) -> FrameResult:
    image = ImageResult((Path(f"f.{frame:g}.exr"),), seconds={"read": 0.25, "draw": 0.5}, **fields)
    return FrameResult(frame, (image,))


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_progress_protocols(protocol: str, capsys: pytest.CaptureFixture[str]) -> None:
    with make_progress(Reporting(progress=protocol), total=3) as progress:
        for frame in (1.0, 2.0, 3.0):
            progress.frame(_result(frame))
    printed = capsys.readouterr()
    assert printed.err.splitlines() == PROTOCOLS[protocol]
    assert not printed.out


def test_json_progress_is_a_line_a_frame(capsys: pytest.CaptureFixture[str]) -> None:
    with make_progress(Reporting(progress="json"), total=1) as progress:
        progress.frame(_result(7.5))
    events = [json.loads(line) for line in capsys.readouterr().err.splitlines()]
    assert events == [
        {"event": "started", "done": 0, "total": 1},
        {"event": "frame", "done": 1, "total": 1, "frame": 7.5, "paths": ["f.7.5.exr"], "skipped": False}
        | {"seconds": {"read": 0.25, "draw": 0.5}},
    ]


def test_more_frames_than_announced_is_not_more_than_all(capsys: pytest.CaptureFixture[str]) -> None:
    with make_progress(Reporting(progress="alf"), total=1) as progress:
        progress.frame(_result(1.0))
        progress.frame(_result(2.0))
    assert capsys.readouterr().err.splitlines() == ["ALF_PROGRESS 0%", "ALF_PROGRESS 100%", "ALF_PROGRESS 100%"]


def test_a_skipped_frame_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    with make_progress(Reporting(), total=1) as progress:
        progress.frame(_result(2.0, skipped=True))
    assert capsys.readouterr().err == "frame 2  → f.2.exr  skipped\n"


@pytest.mark.parametrize(
    ("protocol", "line"),
    [
        ("openjd", "openjd_fail: no such stage"),
        ("json", '{"event": "failed", "done": 0, "total": 1, "message": "no such stage", "exit_code": 3}'),
    ],
)
def test_a_failure_is_told(protocol: str, line: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(StageError), make_progress(Reporting(progress=protocol), total=1):
        raise StageError("no such stage")
    assert capsys.readouterr().err.splitlines()[-1] == line


def test_quiet_says_nothing() -> None:
    assert type(make_progress(Reporting(progress="bar", quiet=True), total=1)) is Progress


@pytest.mark.parametrize(
    ("frame", "name"), [(None, "default"), (7.0, "7"), (-3.0, "-3"), (7.5, "7.5"), (1e6, "1000000")]
)
def test_frame_names_are_short(frame: float | None, name: str) -> None:
    assert frame_name(frame) == name
