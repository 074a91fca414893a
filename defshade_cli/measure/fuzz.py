"""Input that lies: seeded mutations of this project's stages and of what they refer to, each in a contained process.

`python -m defshade_cli.measure.fuzz 10000 [SEED]` counts what became of them, and ends with 1 where some hung, took too
much memory or left a file outside their folder. A process that dies is contained and counted: it costs one frame.
"""

from __future__ import annotations

import logging
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from defshade_cli import resources
from defshade_cli.farm.limits import Limits
from defshade_cli.farm.local import LocalEngine
from defshade_cli.farm.tasks import Chunk, Outcome
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings
from defshade_cli.usd.conversion import write_as

LIMITS = Limits(memory=2048, seconds=10.0)
_PERIOD = 100
"""Inputs from one count on stderr to the next."""
_SETTINGS = RenderSettings(size=(32, 18))
_MUTATED = {".usda", ".usdc", ".usdz", ".png", ".exr", ".ies", ".mtlx", ".jpg", ".hdr"}
_NUMBERS = (b"-1", b"0", b"2147483647", b"-2147483648", b"1e308", b"nan", b"inf", b"4294967295", b"1e-320")

Generator = np.random.Generator
Mutation = Callable[[bytes, Generator], bytes]


@dataclass(frozen=True, slots=True)
class Case:
    """A stage to render, and the file of its folder that lies."""

    stage: Path
    changed: Path


def flipped(data: bytes, rng: Generator) -> bytes:
    """One to sixteen bits are others."""
    values = np.frombuffer(data, np.uint8).copy()
    for place in rng.integers(len(values), size=rng.integers(1, 17)):
        values[place] ^= 1 << rng.integers(8)
    return values.tobytes()


def truncated(data: bytes, rng: Generator) -> bytes:
    return data[: rng.integers(len(data))]


def transplanted(data: bytes, rng: Generator) -> bytes:
    """A run of bytes stands in another place as well."""
    start, to = rng.integers(len(data), size=2)
    run = data[start : start + rng.integers(1, 256)]
    return data[:to] + run + data[to + len(run) :]


def renumbered(data: bytes, rng: Generator) -> bytes:
    """A token that holds digits becomes an extreme number: in text, and rarely elsewhere."""
    tokens = data.split(b" ")
    numeric = [i for i, token in enumerate(tokens) if any(48 <= byte < 58 for byte in token)]
    if numeric:
        tokens[numeric[rng.integers(len(numeric))]] = _NUMBERS[rng.integers(len(_NUMBERS))]
    return b" ".join(tokens)


MUTATIONS: tuple[Mutation, ...] = (flipped, truncated, transplanted, renumbered)


def sources(folder: Path) -> list[Path]:
    """Copies of the stages, in text, crate and package, beside all that they refer to."""
    shutil.copytree(resources.SCENES, folder, dirs_exist_ok=True)
    texts = sorted(folder.glob("*.usda"))
    return [*texts, *(write_as(text, suffix) for text in texts for suffix in (".usdc", ".usdz"))]


def mutated(folder: Path, stages: list[Path], rng: Generator) -> Case:
    """Change one file in the folder: the stage that is rendered, or something that it may refer to."""
    stage = stages[rng.integers(len(stages))]
    others = [path for path in sorted(folder.rglob("*")) if path.suffix in _MUTATED and path.parent != folder]
    changed = stage if rng.random() < 0.7 or not others else others[rng.integers(len(others))]
    changed.write_bytes(MUTATIONS[rng.integers(len(MUTATIONS))](changed.read_bytes(), rng))
    return Case(stage, changed)


def fuzz(count: int, seed: int, folder: Path) -> Iterator[tuple[Case, Outcome, bool]]:
    """Every case, what became of it, and whether a file appeared outside its output folder."""
    pristine, work, out = folder / "pristine", folder / "work", folder / "out"
    names = [stage.relative_to(pristine) for stage in sources(pristine)]
    with LocalEngine(1, threads=1, limits=LIMITS, log_level="CRITICAL") as engine:
        for number in range(count):
            rng = np.random.default_rng((seed, number))
            shutil.copytree(pristine, work, dirs_exist_ok=True)
            case = mutated(work, [work / name for name in names], rng)
            before = _listing(folder, out)
            output = OutputSettings((str(out / "image.exr"),))
            engine.submit(Chunk(RenderJob(case.stage, settings=_SETTINGS, output=output)))
            (outcome,) = engine.outcomes()
            yield case, outcome, _listing(folder, out) != before


def _listing(folder: Path, without: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if without not in (path, *path.parents)}


def verdict(outcome: Outcome, strayed: bool) -> str:
    if strayed:
        return "a file outside"
    if not outcome.error:
        return "rendered"
    if "it took more than" in outcome.error:
        return "memory" if "MiB" in outcome.error else "hang"
    return "lost process" if outcome.error.startswith("its worker process") else f"error {outcome.exit_code}"


def main(count: int, seed: int = 1) -> int:
    logging.getLogger("defshade").setLevel(logging.CRITICAL)
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for number, (case, outcome, strayed) in enumerate(fuzz(count, seed, Path(folder))):
            kind = verdict(outcome, strayed)
            found[kind] += 1
            if kind not in ("rendered", "error 2", "error 3"):
                last = outcome.log.strip().rpartition("\n")[2]
                print(f"{number}: {kind}: {case.stage.name} by {case.changed.name}: {outcome.error} {last}", flush=True)
            if (number + 1) % _PERIOD == 0:
                print(_counts(found, seed), file=sys.stderr, flush=True)
    print(_counts(found, seed))
    return int(any(found[kind] for kind in ("hang", "memory", "a file outside")))


def _counts(found: Counter[str], seed: int) -> str:
    counts = ", ".join(f"{number} {kind}" for kind, number in sorted(found.items()))
    return f"{found.total()} inputs, seed {seed}: {counts}"


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
