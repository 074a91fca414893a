"""What a chunk costs beside its frames: the same frames in chunks of one and of sixteen.

    python benchmarks/chunks.py [ROUNDS]

One worker renders FRAMES tiny frames of one stage, round by round in both ways. What a chunk adds is the hand-over and
the stage being opened and read again; wall time is the least of the rounds, since other work only adds.
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from throughput import STAGE, children_seconds

from defshade_cli.farm.local import LocalEngine
from defshade_cli.farm.tasks import make_chunks
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

FRAMES, SIZES = 64, (1, 16)


@dataclass(frozen=True, slots=True)
class ChunkCost:
    """Seconds that a chunk more adds to its frames, by the clock and of the processor."""

    wall: float
    cpu: float


def measure(rounds: int) -> ChunkCost:
    """The least of the rounds."""
    found: dict[int, list[tuple[float, float]]] = {size: [] for size in SIZES}
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder, "shot.usda")
        stage.write_text(STAGE)
        for number in range(rounds):
            for size in SIZES:
                found[size].append(_rendered(stage, f"{folder}/{number}.{size}.#.exr", size))
    more = FRAMES // SIZES[0] - FRAMES // SIZES[1]
    small, large = (map(min, zip(*found[size], strict=True)) for size in SIZES)
    return ChunkCost(*((many - few) / more for many, few in zip(small, large, strict=True)))


def _rendered(stage: Path, pattern: str, size: int) -> tuple[float, float]:
    """Wall seconds from the first frame's end to the last's, without the worker's start, and processor seconds."""
    frames = tuple(map(float, range(1, FRAMES + 1)))
    settings = RenderSettings(size=(24, 16), shadows=False)
    job = RenderJob(stage, frames, settings=settings, output=OutputSettings(patterns=(pattern,)))
    before = children_seconds()
    with LocalEngine(1, threads=1) as engine:
        for chunk in make_chunks([job], size):
            engine.submit(chunk)
        outcomes = engine.outcomes()
        next(outcomes)
        start = time.perf_counter()
        assert not any(outcome.error for outcome in outcomes)
        seconds = time.perf_counter() - start
    return seconds, children_seconds() - before


if __name__ == "__main__":
    cost = measure(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
    print(f"a chunk more: {1e3 * cost.wall:.1f} ms, {1e3 * cost.cpu:.1f} CPU-ms")
