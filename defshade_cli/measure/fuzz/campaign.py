"""Cases rendered one after another, and what became of them.

A worker process renders case after case, with its libraries loaded and its context made, until one ends it.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from defshade_cli.farm.limits import Limits
from defshade_cli.farm.local import LocalEngine
from defshade_cli.farm.tasks import Chunk, Outcome
from defshade_cli.measure.fuzz.corpus import Case, Corpus
from defshade_cli.resources import core_count
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

_SECONDS = 10.0
LIMITS = Limits(memory=2048, seconds=_SECONDS)
_SETTINGS = RenderSettings(size=(32, 18))

FAULTS = ("bug", "hang", "memory", "a file outside")
"""Verdicts that are faults of ours. A library's crash is contained, and told as an error: it costs one frame."""


def fuzz(numbers: Iterable[int], seed: int, folder: Path) -> Iterator[tuple[int, Case, Outcome, str]]:
    """Each number with its case, what became of it, and the verdict."""
    corpus, out = Corpus(folder / "stages"), folder / "out"
    output = OutputSettings((str(out / "image.exr"),))
    with _engine(LIMITS) as engine:
        for number in numbers:
            case = corpus.case(number, seed)
            job = RenderJob(case.stage, settings=_SETTINGS, output=output)
            before = _listing(folder, out)
            outcome = _outcome(engine, job)
            if verdict(outcome, strayed=False) == "hang" and (busy := _busy()) > 1.0:
                with _engine(replace(LIMITS, seconds=_SECONDS * busy)) as patient:
                    outcome = _outcome(patient, job)
            yield number, case, outcome, verdict(outcome, strayed=_listing(folder, out) != before)


def _engine(limits: Limits) -> LocalEngine:
    return LocalEngine(1, threads=1, limits=limits, log_level="CRITICAL")


def _outcome(engine: LocalEngine, job: RenderJob) -> Outcome:
    engine.submit(Chunk(job))
    (outcome,) = engine.outcomes()
    return outcome


def _busy() -> float:
    """How many processes want each core: ten seconds of a machine that is shared are fewer of its time."""
    return os.getloadavg()[0] / core_count()


def _listing(folder: Path, without: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if without not in (path, *path.parents)}


def verdict(outcome: Outcome, *, strayed: bool) -> str:
    """One word or two for how a mutant ended; `strayed`: a file was written outside its folder."""
    if strayed:
        return "a file outside"
    if not outcome.error:
        return "rendered"
    if "it took more than" in outcome.error:
        return "memory" if "MiB" in outcome.error else "hang"
    if outcome.error.startswith("its worker process"):
        return "crash contained" if "killed by" in outcome.error else "bug"
    return f"error {outcome.exit_code}"
