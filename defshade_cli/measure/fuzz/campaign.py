"""Cases rendered one after another, and what became of them.

A worker process renders case after case, with its libraries loaded and its context made, until one ends it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from defshade_cli.farm.limits import Limits
from defshade_cli.farm.local import LocalEngine
from defshade_cli.farm.tasks import Chunk, Outcome
from defshade_cli.measure.fuzz.corpus import Case, Corpus
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

LIMITS = Limits(memory=2048, seconds=10.0)
_SETTINGS = RenderSettings(size=(32, 18))

FAULTS = ("bug", "hang", "memory", "a file outside")
"""Verdicts that are faults of ours. A library's crash is contained, and told as an error: it costs one frame."""


def fuzz(numbers: Iterable[int], seed: int, folder: Path) -> Iterator[tuple[int, Case, Outcome, str]]:
    """Each number with its case, what became of it, and the verdict."""
    corpus, out = Corpus(folder / "stages"), folder / "out"
    output = OutputSettings((str(out / "image.exr"),))
    with LocalEngine(1, threads=1, limits=LIMITS, log_level="CRITICAL") as engine:
        for number in numbers:
            case = corpus.case(number, seed)
            before = _listing(folder, out)
            engine.submit(Chunk(RenderJob(case.stage, settings=_SETTINGS, output=output)))
            (outcome,) = engine.outcomes()
            yield number, case, outcome, verdict(outcome, strayed=_listing(folder, out) != before)


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
