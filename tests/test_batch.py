"""Batches: what they render is what render renders, whatever becomes of their workers."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from defshade_cli.cli.batch import batch
from defshade_cli.cli.options import Reporting
from defshade_cli.cli.tally import Tally
from defshade_cli.errors import UsageError
from defshade_cli.farm.batch import run_batch
from defshade_cli.farm.local import LocalEngine
from defshade_cli.farm.tasks import Chunk, Outcome, check_batch, chunk_size, failed, joined, make_chunks
from defshade_cli.image.reading import read
from defshade_cli.resources import SCENES
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

SMALL = ("--size", "48x27")
ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder with some stages in `shots/`."""
    (tmp_path / "shots").mkdir()
    for name in ("animated", "gprims"):
        shutil.copy(SCENES / f"{name}.usda", tmp_path / "shots")
    (tmp_path / "shots" / "empty.usda").write_text('#usda 1.0\n\ndef Camera "Eye"\n{\n}\n')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    return tmp_path


def start(*arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "defshade_cli.cli", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def defshade(*arguments: str) -> subprocess.CompletedProcess[str]:
    process = start(*arguments)
    stdout, stderr = process.communicate(timeout=120)
    return subprocess.CompletedProcess(arguments, process.returncode, stdout, stderr)


def refused(*arguments: str) -> UsageError:
    """What a batch says in this process."""
    with pytest.raises(UsageError) as error:
        batch.main([*arguments], standalone_mode=False)
    return error.value


def job(name: str, *frames: float, pattern: str = "out/{scene}.####.exr") -> RenderJob:
    settings = RenderSettings(size=(48, 27))
    return RenderJob(Path("shots", name), frames, settings=settings, output=OutputSettings((pattern,)))


def files(folder: Path) -> list[str]:
    """Hidden ones too."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def assert_same_pixels(ours: Path, theirs: Path) -> None:
    """Every file of one folder is in the other, with the same values to the last bit."""
    assert files(ours) == files(theirs)
    for name in files(ours):
        a, b = read(ours / name), read(theirs / name)
        assert a.keys() == b.keys()
        assert all(np.array_equal(a[layer], b[layer], equal_nan=True) for layer in a), name


def children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def wait_for(pattern: str, seconds: float = 30.0) -> None:
    """Until a file of that name is there."""
    deadline = time.monotonic() + seconds
    while not list(Path().glob(pattern)):
        assert time.monotonic() < deadline, f"{pattern} does not appear"
        time.sleep(0.01)


def test_batch_is_bit_equal_to_render_however_it_is_spread() -> None:
    frames = ("--frames", "1:4", *SMALL, "--samples", "2", "--layers", "beauty,depth", "-q")
    for name in ("animated", "gprims"):
        assert defshade("render", f"shots/{name}.usda", *frames, "-o", "alone/{scene}.####.exr").returncode == 0
    for workers, chunk in (("1", "16"), ("2", "1"), ("2", "3")):
        spread = ("--workers", workers, "--chunk", chunk, "-o", f"spread{workers}{chunk}/{{scene}}.####.exr")
        done = defshade("batch", "shots/animated.usda", "shots/gprims.usda", *frames, *spread)
        assert done.returncode == 0, done.stderr
        assert_same_pixels(Path("alone"), Path(f"spread{workers}{chunk}"))


def test_broken_stages_are_named_and_all_others_rendered(folder: Path) -> None:
    stages = ("shots/empty.usda", "shots/gprims.usda", "shots/missing.usda")
    done = defshade("batch", *stages, "--frames", "1:2", *SMALL, "--stats", "stats.json", "-o", "out/{scene}.#.exr")
    assert done.returncode == 6
    assert files(folder / "out") == ["gprims.1.exr", "gprims.2.exr"]
    assert sorted(done.stdout.split()) == ["out/gprims.1.exr", "out/gprims.2.exr"]
    assert "6 frames in" in done.stderr and "2 rendered, 0 skipped, 4 failed" in done.stderr
    assert "frame 1 of shots/missing.usda failed: no such file: shots/missing.usda" in done.stderr
    assert "2 frames of shots/missing.usda failed, 1 to 2: no such file: shots/missing.usda" in done.stderr
    record = json.loads(Path("stats.json").read_text())
    assert sorted((f["stage"], f["attempts"]) for f in record["frames"] if f["outcome"] == "failed") == [
        ("shots/empty.usda", 2),
        ("shots/empty.usda", 2),
        ("shots/missing.usda", 2),
        ("shots/missing.usda", 2),
    ]


def test_fail_fast_leaves_the_rest() -> None:
    arguments = ("--frames", "1:50", *SMALL, "--fail-fast", "--retries", "0", "--workers", "1", "-o", "o/{scene}.#.exr")
    done = defshade("batch", "shots/missing.usda", "shots/gprims.usda", *arguments)
    assert done.returncode == 6
    assert not Path("o").exists()


def test_killed_workers_cost_no_frame(folder: Path) -> None:
    """Each of two workers once, while it works."""
    process = start("batch", "shots/animated.usda", "--frames", "1:12", *SMALL, "--workers", "2", "-o", "out/#.exr")
    wait_for("out/[0-9]*.exr")
    for child in children(process.pid):
        os.kill(child, signal.SIGKILL)
    _, stderr = process.communicate(timeout=60)
    assert process.returncode == 0, stderr
    assert len(files(folder / "out")) == 12


def test_a_frame_that_kills_its_worker_is_blamed_alone(folder: Path) -> None:
    """The stage is a pipe: reading it waits until the worker is killed."""
    os.mkfifo("shots/trap.usda")
    with LocalEngine(1) as engine:
        engine.submit(Chunk(job("trap.usda", 1.0)))
        engine.submit(Chunk(job("gprims.usda", 1.0, 2.0)))
        outcomes: list[Outcome] = []
        for outcome in _killing(engine, "trap"):
            outcomes.append(outcome)
    assert [outcome.error for outcome in outcomes] == ["its worker process was killed by SIGKILL", "", ""]
    assert outcomes[0].stage == Path("shots/trap.usda")


def _killing(engine: LocalEngine, _stage: str) -> Iterator[Outcome]:
    import threading

    def kill() -> None:
        time.sleep(1.5)
        os.kill(children(os.getpid())[-1], signal.SIGKILL)

    threading.Thread(target=kill, daemon=True).start()
    yield from engine.outcomes()


@pytest.mark.parametrize(("ending", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_ended_batch_leaves_no_process_and_no_partial_file(folder: Path, ending: int, status: int) -> None:
    process = start("batch", "shots/animated.usda", "--frames", "1:500", *SMALL, "--workers", "2", "-o", "out/#.exr")
    wait_for("out/[0-9]*.exr")
    workers = children(process.pid)
    process.send_signal(ending)
    process.communicate(timeout=30)
    assert process.returncode == status
    assert workers and not [pid for pid in workers if Path(f"/proc/{pid}").exists()]
    assert all(re.fullmatch(r"\d+\.exr", name) for name in files(folder / "out"))


class _Scripted:
    """An engine in which a frame fails as often as `failures` says."""

    def __init__(self, failures: dict[float, int]) -> None:
        self.failures, self.queue = failures, list[Chunk]()

    def submit(self, chunk: Chunk) -> None:
        self.queue += chunk.split()

    def outcomes(self) -> Iterator[Outcome]:
        while self.queue:
            task = self.queue.pop(0)
            (frame,) = task.job.frames
            fails = task.attempt <= self.failures.get(frame or 0.0, 0)
            yield failed(task, "no") if fails else Outcome(task, frame)


def test_retries_give_up_in_the_end() -> None:
    chunks = make_chunks([job("gprims.usda", 1.0, 2.0, 3.0)], 2)
    outcomes = run_batch(chunks, _Scripted({2.0: 1, 3.0: 5}), retries=2)
    assert {o.frame: (o.error, o.task.attempt) for o in outcomes} == {1.0: ("", 1), 2.0: ("", 2), 3.0: ("no", 3)}


def test_chunks_hold_every_frame_once() -> None:
    jobs = [job("a.usda", 1.0, 2.0, 3.0), job("b.usda"), job("c.usda", 5.0)]
    chunks = make_chunks(jobs, 2)
    assert [chunk.job.frames for chunk in chunks] == [(1.0, 2.0), (3.0,), (), (5.0,)]
    assert joined(chunks[0].split()) == chunks[0]


def test_chunk_size_shares_small_batches_and_bounds_large_ones() -> None:
    assert (chunk_size(3, 2), chunk_size(64, 2), chunk_size(100_000, 2)) == (1, 8, 16)


def test_stages_that_would_share_a_file_are_refused() -> None:
    with pytest.raises(UsageError, match=r"a\.usda and shots/b\.usda would both be written to out\.1\.exr"):
        check_batch([job("a.usda", 1.0, pattern="out.#.exr"), job("b.usda", 1.0, pattern="out.#.exr")])
    check_batch([job("a.usda", 1.0), replace(job("a.usda", 2.0), camera="/x")])


def test_a_job_file_is_the_same_as_its_options() -> None:
    Path("job.yaml").write_text(
        "stages: [shots/animated.usda, 'shots/g*.usda']\n"
        "frames: 1:3x2\n"
        "settings: {size: 48x27, layers: [beauty, depth], shadows: false}\n"
        "outputs: 'file/{scene}.####.exr'\n"
    )
    assert defshade("batch", "job.yaml", "-q").returncode == 0
    options = ("--frames", "1:3x2", *SMALL, "--layers", "beauty,depth", "--no-shadows", "-o", "line/{scene}.####.exr")
    assert defshade("batch", "shots/animated.usda", "shots/gprims.usda", *options, "-q").returncode == 0
    assert len(files(Path("file"))) == 4
    assert_same_pixels(Path("file"), Path("line"))


def test_dry_run_prints_tasks_and_given_options_count() -> None:
    Path("job.yaml").write_text(
        "stages: shots/animated.usda\nframes: 1:48\ncameras: [/A, /B]\noutputs: '{camera}.#.exr'\n"
    )
    done = defshade("batch", "job.yaml", "--frames", "1:3", "--chunk", "2", "--dry-run")
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [
        "shots/animated.usda  camera /A  frames 1,2  → {camera}.#.exr",
        "shots/animated.usda  camera /A  frames 3  → {camera}.#.exr",
        "shots/animated.usda  camera /B  frames 1,2  → {camera}.#.exr",
        "shots/animated.usda  camera /B  frames 3  → {camera}.#.exr",
    ]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("stages: [a.usda\n", "job.yaml:2: not YAML"),
        ("", "job.yaml: is empty"),
        ("frames: 1\n", "job.yaml: a job file names its stages"),
        ("- a.usda\n", "job.yaml:1: expected keys of stages"),
        ("stages: a.usda\nframe: 1\n", "job.yaml:2: unknown key 'frame'; did you mean 'frames'?"),
        ("stages: a.usda\nframes: 1-10:2\n", "job.yaml:2: frames '1-10:2'"),
        ("stages: a.usda\nsettings:\n  sample: 4\n", "job.yaml:3: unknown key 'sample'; did you mean 'samples'?"),
        ("stages: a.usda\nsettings:\n  samples: 0\n", "job.yaml:3: 0 is not in the range"),
        ("stages: a.usda\nsettings:\n  samples: 1\n  samples: 2\n", "job.yaml:4: 'samples' stands here a second time"),
        ("stages: a.usda\ncameras:\n  - {name: x}\n", "job.yaml:3: expected a value or a list of values"),
        ("stages: 'none/*.usda'\n", "job.yaml:1: no file matches 'none/*.usda'"),
    ],
)
def test_a_wrong_job_file_is_refused_with_its_line(text: str, complaint: str) -> None:
    Path("job.yaml").write_text(text)
    message = str(refused("job.yaml", "--dry-run"))
    assert message.startswith(complaint)
    assert len(message.splitlines()) == 1


def test_progress_speaks_the_farms_languages() -> None:
    arguments = ("shots/gprims.usda", "shots/missing.usda", *SMALL, "--retries", "0", "-o", "{scene}.exr")
    done = defshade("batch", *arguments, "--progress", "openjd")
    assert "openjd_progress: 100.0" in done.stderr.splitlines()
    assert "openjd_fail: 1 of 2 frames failed: shots/missing.usda default" in done.stderr.splitlines()
    events = [
        json.loads(line)
        for line in defshade("batch", *arguments, "--progress", "json").stderr.splitlines()
        if line[0] == "{"
    ]
    assert {event["event"] for event in events} == {"started", "frame", "frame_failed", "failed"}
    assert events[-1]["done"] == 2


def test_frames_that_failed_alike_are_named_in_order() -> None:
    """Whichever of them a worker was done with first."""
    tally = Tally([], Reporting(quiet=True))
    for frame in (2.0, 3.0, 1.0):
        tally.add(Outcome(Chunk(RenderJob(Path("a.usda"), (frame,))), frame, error="no light"))
    assert "3 frames of a.usda failed, 1 to 3: no light" in tally.summary
