"""`python -m defshade_cli.measure.fuzz COUNT [SEED [FIRST [SECONDS]]]` counts what became of so many cases.

FIRST is the number of the first one: a count of 1 renders one case again. After so many SECONDS no other is begun.
Ends with 1 where a verdict is a fault.
"""

from __future__ import annotations

import logging
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from defshade_cli.measure.fuzz.campaign import FAULTS, fuzz

_PERIOD = 100
"""Cases from one count on stderr to the next."""


def main(count: int, seed: int = 1, first: int = 0, seconds: int = sys.maxsize) -> int:
    logging.getLogger("defshade").setLevel(logging.CRITICAL)
    found: Counter[str] = Counter()
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        for number, case, outcome, kind in fuzz(range(first, first + count), seed, Path(folder)):
            found[kind] += 1
            if kind not in ("rendered", "error 2", "error 3"):
                said = outcome.log if kind in FAULTS else ""
                print(
                    f"{number}: {kind}: {case.stage.name} by {case.changed.name}: {outcome.error}\n{said}", flush=True
                )
            if found.total() % _PERIOD == 0:
                print(_counts(found, seed), file=sys.stderr, flush=True)
            if time.monotonic() - start > seconds:
                break
    print(f"{_counts(found, seed)}; {found.total() / (time.monotonic() - start):.1f} a second")
    return int(any(found[kind] for kind in FAULTS))


def _counts(found: Counter[str], seed: int) -> str:
    counts = ", ".join(f"{number} {kind}" for kind, number in sorted(found.items()))
    return f"{found.total()} inputs, seed {seed}: {counts}"


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
