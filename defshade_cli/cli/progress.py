"""The ways of telling, on stderr, how far a job is.

Farm protocols: Tractor's `ALF_PROGRESS 45%` and Open Job Description's `openjd_progress: 45.0`; both read a
task's stdout and stderr as one.
"""

from __future__ import annotations

import logging
import sys
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import click

from defshade_cli.cli.options import Reporting
from defshade_cli.errors import DefshadeError

if TYPE_CHECKING:
    from defshade_cli.farm.tasks import Outcome
    from defshade_cli.rendering import FrameResult


class Progress:
    """Tells nothing: `none`, and the base of the others. A context manager around the frames of one job."""

    def __init__(self, total: int) -> None:
        self.total, self.done = total, 0

    def __enter__(self) -> Self:
        self.started()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if isinstance(error, DefshadeError):
            self.failed(error)

    def frame(self, result: FrameResult | Outcome) -> None:
        """One more frame is done."""
        self.done += 1
        self.finished(result)

    def frame_failed(self, outcome: Outcome) -> None:
        """One more frame of a batch has failed, for good."""
        self.done += 1
        self.lost(outcome)

    @property
    def percent(self) -> float:
        """How much is done, in [0, 100]."""
        return min(100.0, 100.0 * self.done / self.total)

    def started(self) -> None:
        """Tell that work begins."""

    def finished(self, result: FrameResult | Outcome) -> None:
        """Tell of a frame whose files stand."""

    def lost(self, outcome: Outcome) -> None:
        """Tell of a frame that failed for good."""

    def failed(self, error: DefshadeError) -> None:
        """Tell of what ended the job."""


class Lines(Progress):
    """A line a frame, for logs."""

    def finished(self, result: FrameResult | Outcome) -> None:
        paths = ", ".join(map(str, result.paths))
        cost = "skipped" if result.skipped else f"{sum(result.seconds.values()):.2f} s"
        _say(f"frame {frame_name(result.frame)}  → {paths}  {cost}")

    def lost(self, outcome: Outcome) -> None:
        _say(failure(outcome))


class Alf(Progress):
    """Percentages are rounded down, so that 100 means done."""

    def started(self) -> None:
        _say("ALF_PROGRESS 0%")

    def finished(self, result: FrameResult | Outcome) -> None:
        _say(f"ALF_PROGRESS {int(self.percent)}%")

    def lost(self, outcome: Outcome) -> None:
        _say(failure(outcome))
        _say(f"ALF_PROGRESS {int(self.percent)}%")


class OpenJd(Progress):
    def started(self) -> None:
        _say("openjd_progress: 0.0")

    def finished(self, result: FrameResult | Outcome) -> None:
        _say(f"openjd_progress: {self.percent:.1f}")
        _say(f"openjd_status: frame {frame_name(result.frame)}, {self.done} of {self.total}")

    def lost(self, outcome: Outcome) -> None:
        _say(f"openjd_progress: {self.percent:.1f}")
        _say(f"openjd_status: {failure(outcome)}")

    def failed(self, error: DefshadeError) -> None:
        _say(f"openjd_fail: {error}")


class JsonLines(Progress):
    """One object a line: started, frame, frame_failed, failed."""

    def started(self) -> None:
        self._event("started")

    def finished(self, result: FrameResult | Outcome) -> None:
        paths = [str(path) for path in result.paths]
        self._event("frame", frame=result.frame, paths=paths, skipped=result.skipped, seconds=result.seconds)

    def lost(self, outcome: Outcome) -> None:
        stage = str(outcome.stage)
        self._event("frame_failed", stage=stage, frame=outcome.frame, message=outcome.error, log=outcome.log)

    def failed(self, error: DefshadeError) -> None:
        self._event("failed", message=str(error), exit_code=error.exit_code)

    def _event(self, name: str, **facts: Any) -> None:
        import json

        _say(json.dumps({"event": name, "done": self.done, "total": self.total, **facts}))


class Bar(Progress):
    """A bar that redraws itself, for terminals; stdout is left alone where it is redirected."""

    def __enter__(self) -> Self:
        from rich.console import Console
        from rich.progress import (
            MofNCompleteColumn,
            Progress,
            SpinnerColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        columns = [
            *Progress.get_default_columns()[:2],
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
        ]
        console = Console(stderr=True)
        self._bar = Progress(
            SpinnerColumn(), *columns, console=console, transient=True, redirect_stdout=sys.stdout.isatty()
        )
        self._task = self._bar.add_task("rendering", total=self.total)
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def finished(self, result: FrameResult | Outcome) -> None:
        self._bar.update(self._task, completed=self.done, description=f"frame {frame_name(result.frame)}")


class _Echo(logging.Handler):
    """Log records as lines on stderr, above the bar where there is one."""

    def emit(self, record: logging.LogRecord) -> None:
        _say(f"defshade: {record.levelname.lower()}: {record.getMessage()}")


def make_progress(reporting: Reporting, total: int, bar: type[Progress] = Bar) -> Progress:
    """The Progress that the options ask for, for `total` frames. bar: the one for terminals."""
    kinds = {"bar": bar, "alf": Alf, "openjd": OpenJd, "json": JsonLines, "none": Progress}
    if reporting.quiet:
        return Progress(total)
    automatic = bar if sys.stderr.isatty() else Lines
    return kinds.get(reporting.progress, automatic)(total)


def start_logging(reporting: Reporting) -> None:
    """Show the package's log from warnings up; from errors up when quiet, everything when verbose."""
    show_log(logging.ERROR if reporting.quiet else logging.DEBUG if reporting.verbose else logging.WARNING)


def show_log(level: int = logging.WARNING) -> None:
    """Show the package's log on stderr, from a level of `logging` up."""
    logger = logging.getLogger("defshade")
    logger.setLevel(level)
    logger.handlers = [_Echo()]


def frame_name(frame: float | None) -> str:
    """`7`, `7.5`, or `default`."""
    if frame is None:
        return "default"
    return str(int(frame)) if frame == int(frame) else str(frame)


def failure(outcome: Outcome) -> str:
    """`frame 7 of shot.usda failed: its reason`."""
    return f"frame {frame_name(outcome.frame)} of {outcome.stage} failed: {outcome.error}"


def _say(line: str) -> None:
    click.echo(line, err=True)
