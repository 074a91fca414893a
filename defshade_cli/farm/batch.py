"""The story of a batch: chunks → an engine → outcomes, and what failed once more."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol

from defshade_cli.farm.tasks import Chunk, Outcome


class Engine(Protocol):
    """Whatever renders chunks elsewhere: processes of this machine, or a cluster."""

    def submit(self, chunk: Chunk) -> None:
        """Take a chunk, now or while outcomes are being read."""

    def outcomes(self) -> Iterator[Outcome]:
        """One outcome for every frame submitted, as they come, until none is left."""


def run_batch(
    chunks: Iterable[Chunk], engine: Engine, *, retries: int = 1, keep_going: bool = True
) -> Iterator[Outcome]:
    """The last outcome of every frame; a frame that failed is rendered again up to `retries` times.

    Without `keep_going` the first frame that fails for good is the last outcome.
    """
    for chunk in chunks:
        engine.submit(chunk)
    for outcome in engine.outcomes():
        if outcome.error and outcome.task.attempt <= retries:
            engine.submit(outcome.task.again())
            continue
        yield outcome
        if outcome.error and not keep_going:
            return
