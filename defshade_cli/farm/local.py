"""The local engine: worker processes of this machine, a GL context each.

What a stage or a driver can do to a process, it does to a worker: the frame at work when one dies has failed, the rest
of its chunk goes back to the queue, and another worker takes its place. The scheduler itself loads neither USD nor GL.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Pipe, wait
from pathlib import Path
from types import TracebackType
from typing import Self

from defshade_cli.farm.limits import INTERVAL, Limits
from defshade_cli.farm.tasks import Chunk, Outcome, failed, joined
from defshade_cli.resources import core_count

BYTES_PER_WORKER = 3 << 29
"""1.5 GiB: a process with its libraries takes 330 MiB, a 1920x1080 frame with all layers some 500 MiB more."""

_PATIENCE = 5.0  # seconds that a worker has to end when asked


NO_LIMITS = Limits()


class LocalEngine:
    """An Engine of up to `workers` processes; a context manager that ends them.

    threads: of the software driver, a worker; None shares the cores evenly. LP_NUM_THREADS in the environment wins.
    command: goes into the files' headers.  log_level: of the workers' logs.
    limits: of a frame; a worker that passes one is killed.
    """

    def __init__(
        self,
        workers: int,
        *,
        threads: int | None = None,
        command: str = "",
        log_level: str = "WARNING",
        limits: Limits = NO_LIMITS,
    ) -> None:
        self._limits = limits
        self._limit = workers
        self._threads = threads or max(1, core_count() // workers)
        self._arguments = (command, log_level, str(limits.memory or 0))
        self._queue: deque[Chunk] = deque()
        self._workers: list[_Worker] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()

    def end(self) -> None:
        """End the processes; what they had still to do is lost."""
        for worker in self._workers:
            worker.process.terminate()
        for worker in self._workers:
            worker.end()
        self._workers.clear()

    def submit(self, chunk: Chunk) -> None:
        """Queue a chunk; workers take it while the outcomes are read."""
        self._queue.append(chunk)

    def outcomes(self) -> Iterator[Outcome]:
        """The frames' outcomes as they come, until nothing is left of what was submitted, meanwhile too."""
        while self._queue or self._busy():
            self._dispatch()
            patience = INTERVAL if self._limits else None
            for connection in wait([worker.connection for worker in self._busy()], patience):
                yield from self._heard(next(w for w in self._workers if w.connection is connection))
            for worker in self._busy():
                worker.watch(self._limits)

    def _busy(self) -> list[_Worker]:
        return [worker for worker in self._workers if worker.pending]

    def _dispatch(self) -> None:
        """Chunks to idle workers, and new workers while there is more work than workers."""
        for worker in [worker for worker in self._workers if not worker.pending]:
            if self._queue:
                worker.take(self._queue.popleft())
        while self._queue and len(self._workers) < self._limit:
            worker = _Worker(self._threads, *self._arguments)
            self._workers.append(worker)
            worker.take(self._queue.popleft())

    def _heard(self, worker: _Worker) -> Iterator[Outcome]:
        try:
            outcome: Outcome = worker.connection.recv()
        except (EOFError, OSError):
            yield from self._bury(worker)
            return
        worker.answered()
        yield replace(outcome, log=worker.read_log())

    def _bury(self, worker: _Worker) -> list[Outcome]:
        """Give up a dead worker. The frame at work is to blame; what it did not come to goes back to the queue."""
        self._workers.remove(worker)
        reason = worker.end()
        if not worker.pending:
            return []
        blamed, *rest = worker.pending
        if rest:
            self._queue.appendleft(joined(rest))
        return [replace(failed(blamed, reason), log=worker.read_log())]


class _Worker:
    """One process, the connection to it, and the frames that it has still to answer for."""

    def __init__(self, threads: int, *arguments: str) -> None:
        self.pending: deque[Chunk] = deque()
        self._log = tempfile.TemporaryFile()  # noqa: SIM115  lives as long as the worker
        self._read = 0
        self._began, self._killed_for = 0.0, ""
        self.connection, theirs = Pipe()
        with theirs:
            command = [sys.executable, "-m", "defshade_cli.farm.worker", str(theirs.fileno()), *arguments]
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=self._log,
                stderr=subprocess.STDOUT,
                pass_fds=[theirs.fileno()],
                env={"LP_NUM_THREADS": str(threads), **os.environ},
                start_new_session=True,  # an interrupt from the keyboard is the scheduler's to handle
            )

    def take(self, chunk: Chunk) -> None:
        """Send the chunk. That the process is dead is found out where its answer is awaited."""
        self._began = time.monotonic()
        self.pending.extend(chunk.split())
        with suppress(OSError):
            self.connection.send(chunk)

    def answered(self) -> None:
        """A frame is done; the next one begins."""
        self.pending.popleft()
        self._began = time.monotonic()

    def watch(self, limits: Limits) -> None:
        """Kill the process where its frame takes more than it may; the connection then says that it is dead."""
        if not self._killed_for and (reason := limits.passed_by(self.process.pid, self._began)):
            self._killed_for = reason
            self.process.kill()

    def end(self) -> str:
        """Wait for the process, by force in the end. Returns how it ended."""
        self.connection.close()
        try:
            status = self.process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            status = self.process.wait()
        return self._killed_for or f"its worker process {_ending(status)}"

    def read_log(self) -> str:
        """What was logged since the last time."""
        self._log.flush()
        text = os.pread(self._log.fileno(), os.fstat(self._log.fileno()).st_size - self._read, self._read)
        self._read += len(text)
        return text.decode(errors="replace")


def default_workers(chunks: int) -> int:
    """One a core, as long as memory suffices and there is work for each."""
    return max(1, min(core_count(), _available_memory() // BYTES_PER_WORKER, chunks))


def _available_memory() -> int:
    """Bytes that can be had without swapping: proc(5), MemAvailable."""
    match = re.search(r"^MemAvailable:\s*(\d+) kB", Path("/proc/meminfo").read_text(), re.MULTILINE)
    return int(match[1]) * 1024 if match else sys.maxsize


def _ending(status: int) -> str:
    if status >= 0:
        return f"ended with {status}"
    try:
        return f"was killed by {signal.Signals(-status).name}"
    except ValueError:
        return f"was killed by signal {-status}"
