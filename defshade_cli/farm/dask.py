"""The engine for machines that Dask brings together: `distributed`, which is loaded here alone.

    https://distributed.dask.org/en/stable/

A task is a chunk. It is rendered in a process of its own beside the Dask worker, so that a driver that crashes takes no
worker along; a worker that dies all the same has its chunks rendered elsewhere by Dask. Hosts need defshade installed,
and the stages and outputs under the same paths.
"""

from __future__ import annotations

import atexit
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from threading import Lock, Timer
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from defshade_cli.errors import UsageError
from defshade_cli.farm.local import LocalEngine
from defshade_cli.farm.tasks import Chunk, Outcome, failed
from defshade_cli.resources import core_count

if TYPE_CHECKING:
    from distributed import Client, Future

_PATIENCE = 10.0  # seconds that a scheduler has to answer
_IDLE_SECONDS = 60.0  # that a child process waits for a chunk


class DaskEngine:
    """An Engine on a cluster; a context manager that leaves it, and ends it where it began it.

    scheduler: address to join, such as tcp://farm:8786; None starts `workers` on this machine.
    resources: what a worker must have to spare for a chunk, such as {"GPU": 1}.
    command: goes into the files' headers.  log_level: of the workers' logs.
    Raises UsageError without `distributed`, and for a scheduler that does not answer.
    """

    def __init__(
        self,
        scheduler: str | None,
        workers: int,
        *,
        resources: dict[str, float] | None = None,
        command: str = "",
        log_level: str = "WARNING",
    ) -> None:
        self._remote, self._resources = scheduler is not None, resources or None
        self._arguments = (1 if scheduler else max(1, core_count() // workers), command, log_level)
        self._pending: dict[str, tuple[Future[Any], Chunk]] = {}
        with ExitStack() as stack:
            self._client = _connected(stack, scheduler, workers, self._resources)
            self._stack = stack.pop_all()
        from distributed import as_completed

        self._completed = as_completed()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.cancel([future for future, _ in self._pending.values()])
        self._stack.close()

    @property
    def dashboard(self) -> str:
        """Address of the scheduler's web page."""
        return str(self._client.dashboard_link)

    def submit(self, chunk: Chunk) -> None:
        """Hand a chunk to the cluster; it may start at once."""
        chunk = _anywhere(chunk) if self._remote else chunk
        future = self._client.submit(render_apart, chunk, *self._arguments, pure=False, resources=self._resources)
        self._pending[str(future.key)] = future, chunk
        self._completed.add(future)

    def outcomes(self) -> Iterator[Outcome]:
        """The frames' outcomes as they come, until nothing is left of what was submitted, meanwhile too."""
        for future in self._completed:
            _, chunk = self._pending.pop(str(future.key))
            yield from future.result() if future.status == "finished" else self._lost(chunk, future)

    def _lost(self, chunk: Chunk, future: Future[Any]) -> Iterator[Outcome]:
        """Of a chunk that brought down several workers the frames apart, until the one to blame stands alone."""
        tasks = chunk.split()
        if len(tasks) == 1:
            yield failed(chunk, f"Dask gave it up: {future.exception()}")
            return
        for task in tasks:
            self.submit(task)


def render_apart(chunk: Chunk, threads: int, command: str, log_level: str) -> list[Outcome]:
    """What a Dask worker runs: the chunk in a child process. threads: of the software driver.

    The process stays for the next chunk, which spares it the start, and ends when none has come for a while.
    """
    engine = _idle.take(threads, command, log_level)
    try:
        engine.submit(chunk)
        outcomes = list(engine.outcomes())
    except BaseException:
        engine.end()
        raise
    _idle.leave(engine, threads, command, log_level)
    return outcomes


class _Idle:
    """Child processes that wait for a chunk; a Dask worker has as many as threads that render at a time."""

    def __init__(self) -> None:
        self._waiting: list[tuple[tuple[int, str, str], LocalEngine, Timer]] = []
        self._lock = Lock()
        atexit.register(self._end_all)

    def take(self, *arguments: Any) -> LocalEngine:
        """One that was started with these arguments, else a new one."""
        with self._lock:
            for place, (started_with, engine, timer) in enumerate(self._waiting):
                if started_with == arguments:
                    timer.cancel()
                    del self._waiting[place]
                    return engine
        threads, command, log_level = arguments
        return LocalEngine(1, threads=threads, command=command, log_level=log_level)

    def leave(self, engine: LocalEngine, *arguments: Any) -> None:
        timer = Timer(_IDLE_SECONDS, self._end, [engine])
        timer.daemon = True
        with self._lock:
            self._waiting.append((arguments, engine, timer))
        timer.start()

    def _end(self, engine: LocalEngine) -> None:
        with self._lock:
            kept = [entry for entry in self._waiting if entry[1] is not engine]
            was_waiting, self._waiting = len(kept) < len(self._waiting), kept
        if was_waiting:
            engine.end()

    def _end_all(self) -> None:
        for _, engine, _ in list(self._waiting):
            self._end(engine)


_idle = _Idle()


def _connected(stack: ExitStack, scheduler: str | None, workers: int, resources: dict[str, float] | None) -> Client:
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise UsageError("the engine dask needs the package distributed: pip install 'defshade[farm]'") from None
    if scheduler is not None:
        try:
            return stack.enter_context(Client(scheduler, timeout=_PATIENCE))
        except (OSError, ValueError) as error:
            raise UsageError(f"no Dask scheduler answers at {scheduler}: {error}") from error
    cluster = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=":0", resources=resources)
    return stack.enter_context(Client(stack.enter_context(cluster)))


def _anywhere(chunk: Chunk) -> Chunk:
    """With absolute paths: workers on other hosts have other working folders."""
    job = chunk.job
    patterns = tuple(str(Path(pattern).absolute()) for pattern in job.output.patterns)
    output = replace(job.output, patterns=patterns)
    return replace(chunk, job=replace(job, stage=job.stage.absolute(), output=output))
