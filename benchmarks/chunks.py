"""What a chunk costs beside its frames: the same frames in chunks of one and of sixteen: `make bench-farm`.

    python benchmarks/chunks.py [ROUNDS]

One worker renders FRAMES tiny frames of one stage, round by round in both ways. What a chunk adds is the hand-over and
the stage being opened and read again; wall time is the least of the rounds, since other work only adds.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from throughput import STAGE, children_seconds

from defshade_cli.farm.local import LocalEngine
from defshade_cli.farm.tasks import make_chunks
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

FRAMES, SIZES = 64, (1, 16)


def main(rounds: int) -> None:
    wall: dict[int, list[float]] = {size: [] for size in SIZES}
    cpu: dict[int, list[float]] = {size: [] for size in SIZES}
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder, "shot.usda")
        stage.write_text(STAGE)
        for number in range(rounds):
            for size in SIZES:
                seconds = _rendered(stage, f"{folder}/{number}.{size}.#.exr", size)
                wall[size].append(seconds[0])
                cpu[size].append(seconds[1])
    more = FRAMES // SIZES[0] - FRAMES // SIZES[1]
    for name, found in (("wall", wall), ("processor", cpu)):
        few, many = (min(found[size]) for size in reversed(SIZES))
        print(f"{name}: {1e3 * (many - few) / more:.1f} ms a chunk more, {1e3 * few / FRAMES:.1f} ms a frame")


def _rendered(stage: Path, pattern: str, size: int) -> tuple[float, float]:
    """Wall and processor seconds from the first frame's end to the last's: without the worker's start."""
    frames = tuple(map(float, range(1, FRAMES + 1)))
    settings, output = RenderSettings(size=(24, 16)), OutputSettings(patterns=(pattern,))
    job = RenderJob(stage, frames, settings=settings, output=output, given=frozenset({"size"}))
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
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
