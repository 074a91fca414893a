"""The live table of a batch, for terminals: the stages at work, then all together with rate and time left."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from defshade_cli.cli.progress import Progress, frame_name
from defshade_cli.dataclass import dataclass

if TYPE_CHECKING:
    from rich.table import Table

    from defshade_cli.farm.tasks import Outcome
    from defshade_cli.rendering import FrameResult

_ROWS = 8


@dataclass(slots=True)
class _Row:
    """A stage so far. seconds: of its frames together; slowest: (seconds, frame)."""

    done: int = 0
    failed: int = 0
    seconds: float = 0.0
    slowest: tuple[float, str] = (0.0, "")


class BatchTable(Progress):
    """The stages that were heard of last, up to eight."""

    def __enter__(self) -> Self:
        from rich.console import Console
        from rich.live import Live

        self._start = time.perf_counter()
        self._rows: dict[Path, _Row] = {}
        self._live = Live(
            console=Console(stderr=True),
            get_renderable=self._table,
            transient=True,
            redirect_stdout=sys.stdout.isatty(),
        )
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def finished(self, result: FrameResult | Outcome) -> None:
        seconds = sum(result.seconds.values())
        row = self._latest(getattr(result, "stage", Path()))
        row.done += 1
        row.seconds += seconds
        row.slowest = max(row.slowest, (seconds, frame_name(result.frame)))

    def lost(self, outcome: Outcome) -> None:
        self._latest(outcome.stage).failed += 1

    def _latest(self, stage: Path) -> _Row:
        """The row of a stage, moved to the end."""
        row = self._rows.pop(stage, _Row())
        self._rows[stage] = row
        return row

    def _table(self) -> Table:
        from rich.table import Table

        table = Table("stage", "done", "failed", "s a frame", "slowest", box=None, show_footer=True)
        for stage, row in list(self._rows.items())[-_ROWS:]:
            mean = f"{row.seconds / row.done:.2f}" if row.done else ""
            slowest = f"{row.slowest[0]:.2f} s, frame {row.slowest[1]}" if row.done else ""
            table.add_row(str(stage), str(row.done), str(row.failed or ""), mean, slowest)
        failed = sum(row.failed for row in self._rows.values())
        footers = ("all", f"{self.done} of {self.total}", str(failed or ""), *self._pace())
        for column, footer in zip(table.columns, footers, strict=True):
            column.footer = footer
        return table

    def _pace(self) -> tuple[str, str]:
        """Frames a second, and the time left at that rate."""
        rate = self.done / (time.perf_counter() - self._start)
        left = f"{(self.total - self.done) / rate:.0f} s left" if self.done else ""
        return f"{rate:.1f} a second", left
