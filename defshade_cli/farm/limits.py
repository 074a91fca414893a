"""What a worker may take for a frame, and whether it has taken more."""

from __future__ import annotations

import os
import re
import resource
import time
from pathlib import Path

from defshade_cli.dataclass import dataclass

INTERVAL = 0.2
"""Seconds between two looks at workers that have a limit."""

_MIB = 1 << 20
_FOR_THE_DRIVER = 256 * _MIB
"""Stacks of its threads, and code that it compiles."""


@dataclass(frozen=True, slots=True)
class Limits:
    """memory: MiB that the worker's process holds in RAM.  seconds: of wall time for one frame. None is no limit."""

    memory: int | None = None
    seconds: float | None = None

    def __bool__(self) -> bool:
        return self.memory is not None or self.seconds is not None

    def passed_by(self, process: int, since: float) -> str:
        """How the process, at its frame since that time.monotonic(), has passed a limit; empty while it has not."""
        if self.seconds is not None and time.monotonic() - since > self.seconds:
            return f"it took more than {self.seconds:g} s"
        if self.memory is not None and _resident(process) > self.memory * _MIB:
            return f"it took more than {self.memory} MiB of memory"
        return ""


def build_wall(memory: int) -> None:
    """Let this process fail to allocate what would take it past `memory` MiB, which comes too fast to be watched.

    A process that has as much already is left to the watch: setrlimit(2), RLIMIT_DATA.
    """
    mapped = int(re.search(r"VmData:\s*(\d+) kB", Path("/proc/self/status").read_text())[1]) * 1024  # type: ignore[index]
    wall = max(memory * _MIB, mapped + _FOR_THE_DRIVER)
    resource.setrlimit(resource.RLIMIT_DATA, (wall, resource.getrlimit(resource.RLIMIT_DATA)[1]))


def _resident(process: int) -> int:
    """Bytes in RAM: proc(5), statm; 0 for a process that has ended."""
    try:
        pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")
