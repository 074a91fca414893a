"""Batches on Dask: clusters of real worker processes on the loopback."""

from __future__ import annotations

import os
import shutil
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from defshade_cli.errors import UsageError
from defshade_cli.farm.batch import run_batch
from defshade_cli.farm.dask import DaskEngine, render_apart
from defshade_cli.farm.tasks import Outcome, make_chunks
from defshade_cli.image.reading import read
from defshade_cli.resources import SCENES
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

distributed = pytest.importorskip("distributed", reason="distributed is not installed: pip install 'defshade[farm]'")

FRAMES = (1.0, 2.0, 3.0, 4.0, 5.0)
ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a stage."""
    shutil.copy(SCENES / "animated.usda", tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[distributed.LocalCluster]:
    """Two workers with a GPU each to spare, whose working folder is not the tests'."""
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", paths)
        patch.chdir(tmp_path_factory.mktemp("elsewhere"))
        options = {"dashboard_address": ":0", "resources": {"GPU": 1}}
        with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **options) as cluster:
            yield cluster


def job(name: str, folder: str) -> RenderJob:
    output = OutputSettings((f"{folder}/{{scene}}.#.exr",))
    return RenderJob(Path(f"{name}.usda"), FRAMES, settings=RenderSettings(size=(48, 27)), output=output)


def batch_on(cluster: distributed.LocalCluster, *jobs: RenderJob) -> list[Outcome]:
    with DaskEngine(cluster.scheduler_address, 2, resources={"GPU": 1}) as engine:
        return list(run_batch(make_chunks(jobs, 2), engine))


def test_frames_are_bit_equal_to_the_local_engine_and_failures_come_back(cluster: distributed.LocalCluster) -> None:
    outcomes = batch_on(cluster, job("animated", "dask"), job("missing", "dask"))
    assert sorted(o.frame for o in outcomes if not o.error) == list(FRAMES)
    assert {(o.stage.name, o.task.attempt) for o in outcomes if o.error} == {("missing.usda", 2)}
    (chunk,) = make_chunks([job("animated", "local")], 5)
    assert not any(outcome.error for outcome in render_apart(chunk, 2, "", "WARNING"))
    for frame in FRAMES:
        ours, theirs = (read(Path(f"{engine}/animated.{frame:.0f}.exr")) for engine in ("dask", "local"))
        assert np.array_equal(ours["beauty"], theirs["beauty"])


def test_a_worker_that_is_killed_costs_no_frame(cluster: distributed.LocalCluster) -> None:
    victim = next(iter(cluster.workers.values())).pid

    def kill() -> None:
        time.sleep(0.5)
        os.kill(victim, signal.SIGKILL)

    killer = Thread(target=kill)
    killer.start()
    outcomes = batch_on(cluster, job("animated", "out"))
    killer.join()
    assert sorted(o.frame for o in outcomes) == list(FRAMES)
    assert not [o.error for o in outcomes if o.error]


def test_a_child_process_serves_chunk_after_chunk_and_ends_when_none_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("defshade_cli.farm.dask._IDLE_SECONDS", 1.0)
    first, second = make_chunks([job("animated", "out")], 3)

    def children() -> set[str]:
        return set(Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split())

    others = children()
    assert not any(outcome.error for outcome in render_apart(first, 1, "once", "WARNING"))
    started = children() - others
    assert len(started) == 1
    assert not any(outcome.error for outcome in render_apart(second, 1, "once", "WARNING"))
    assert children() - others == started
    deadline = time.monotonic() + 20.0
    while children() - others and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not children() - others


def test_a_scheduler_that_is_not_there_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("defshade_cli.farm.dask._PATIENCE", 0.5)
    with pytest.raises(UsageError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        DaskEngine("tcp://127.0.0.1:9", 1)
