"""Items through workers, some at a time; a worker that dies costs the case it was at, not the rest of its item."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from defshade_cli.measure.conformance.catalogue import Case
from defshade_cli.measure.conformance.results import Result, result_of

PATIENCE = 300.0
"""Seconds that one worker may take for what is left of its item."""


def examine_items(items: Mapping[str, Sequence[Case]], assets: Path, out: Path, workers: int) -> Iterator[list[Result]]:
    """The results of item after item, their pictures in `out`."""
    out.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(workers) as pool:
        yield from pool.map(lambda item: _examine(items[item], assets / item, out, workers), items)


def _examine(cases: Sequence[Case], item: Path, out: Path, workers: int) -> list[Result]:
    results: list[Result] = []
    while left := cases[len(results) :]:
        for case in left:
            _file(case, out).unlink(missing_ok=True)
        ending = _run_worker(item, out, left, max(1, (os.cpu_count() or 1) // workers))
        done = [Result.from_json(json.loads(_file(c, out).read_text("utf-8"))) for c in left if _file(c, out).exists()]
        results += done
        if len(done) < len(left):
            results.append(result_of(left[len(done)], error=ending))
    return results


def _run_worker(item: Path, out: Path, cases: Sequence[Case], threads: int) -> str:
    """Run it to its end. Returns how that came about."""
    command = [sys.executable, "-m", "defshade_cli.measure.conformance.worker", str(item), str(out)]
    environment = {"LP_NUM_THREADS": str(threads), **os.environ}
    try:
        ended = subprocess.run(
            [*command, *(case.key for case in cases)],
            env=environment,
            timeout=PATIENCE,
            capture_output=True,
            text=True,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"its worker took more than {PATIENCE:g} s"
    said = ended.stderr.strip().rpartition("\n")[2]
    return f"its worker ended with {ended.returncode}: {said}"


def _file(case: Case, out: Path) -> Path:
    return out / f"{case.key}.json"
