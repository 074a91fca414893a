"""What a batch came to: counts, failures with their logs, and the record that --stats writes of it."""

from __future__ import annotations

import math
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import click

from defshade_cli import __version__
from defshade_cli.cli.options import Reporting
from defshade_cli.cli.progress import failure, frame_name
from defshade_cli.cli.stats import write_record
from defshade_cli.settings import RenderJob

if TYPE_CHECKING:
    from defshade_cli.farm.tasks import Outcome

_NAMED = 5


class Tally:
    """Gathers outcomes; a context manager that prints the summary and writes the record, also after an interruption.

    report: the page that farm.report writes at the end, None for none.
    The record is written before the batch as well, so that a file that cannot be written costs no render: OutputError.
    """

    def __init__(self, jobs: Sequence[RenderJob], reporting: Reporting, report: Path | None = None) -> None:
        self.failures: list[Outcome] = []
        self._outcomes: list[Outcome] = []
        self._report = report
        self._counts = {"rendered": 0, "skipped": 0, "failed": 0}
        self._reporting, self._start = reporting, time.perf_counter()
        self._record: dict[str, Any] = {"version": __version__, "jobs": jobs, "frames": []}
        self._said: set[str] = set()

    def __enter__(self) -> Self:
        self._write()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._reporting.quiet and (error is None or any(self._counts.values())):
            click.echo(self.summary, err=True)
        self._record["seconds"] = time.perf_counter() - self._start
        self._write()
        if self._report is not None:
            from defshade_cli.farm.report import write_report

            write_report(self._outcomes, self._record["seconds"], self._report)

    def add(self, outcome: Outcome) -> None:
        """Count the outcome, and show what its log says that no log before it said."""
        what = "failed" if outcome.error else "skipped" if outcome.skipped else "rendered"
        self._counts[what] += 1
        if outcome.error:
            self.failures.append(outcome)
        if self._report is not None:
            self._outcomes.append(outcome)
        if self._reporting.stats is not None:
            self._record["frames"].append(_figures(outcome, what))
        if not self._reporting.quiet:
            self._show(outcome.log)

    @property
    def summary(self) -> str:
        """Counts, time and rate, then a line for what failed alike."""
        seconds = time.perf_counter() - self._start
        done = sum(self._counts.values())
        counts = ", ".join(f"{count} {what}" for what, count in self._counts.items())
        noun = "frame" if done == 1 else "frames"
        head = f"{done} {noun} in {seconds:.1f} s ({done / seconds:.1f} a second): {counts}"
        return "\n".join([head, *(f"  {line}" for line in _failures(self.failures))])

    @property
    def verdict(self) -> str:
        """One sentence that names the frames that failed, the first few of them."""
        named = [f"{outcome.stage} {frame_name(outcome.frame)}" for outcome in self.failures[:_NAMED]]
        more = f" and {len(self.failures) - _NAMED} more" if len(self.failures) > _NAMED else ""
        return f"{len(self.failures)} of {sum(self._counts.values())} frames failed: {', '.join(named)}{more}"

    def _show(self, log: str) -> None:
        for line in log.splitlines():
            if line not in self._said:
                self._said.add(line)
                click.echo(line, err=True)

    def _write(self) -> None:
        if self._reporting.stats is not None:
            write_record(self._reporting.stats, self._record)


def _failures(outcomes: Iterable[Outcome]) -> Iterator[str]:
    """A line each, or one for the frames of a stage that failed for the same reason."""
    alike = defaultdict(list)
    for outcome in outcomes:
        alike[outcome.stage, outcome.error].append(outcome)
    for (stage, error), those in alike.items():
        those.sort(key=lambda outcome: -math.inf if outcome.frame is None else outcome.frame)
        first, last = (frame_name(outcome.frame) for outcome in (those[0], those[-1]))
        several = f"{len(those)} frames of {stage} failed, {first} to {last}: {error}"
        yield failure(those[0]) if len(those) == 1 else several


def _figures(outcome: Outcome, what: str) -> dict[str, Any]:
    return {
        "stage": outcome.stage,
        "camera": outcome.task.job.camera,
        "frame": outcome.frame,
        "outcome": what,
        "attempts": outcome.task.attempt,
        "paths": outcome.paths,
        "seconds": outcome.seconds,
        "error": outcome.error,
        "log": outcome.log,
    }
