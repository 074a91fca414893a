"""Frames a second of a batch by its number of workers, each with one thread of llvmpipe.

python benchmarks/throughput.py [WORKERS...]
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

STAGES, FRAMES, ROUNDS = 8, 24, 2
STAGE = """#usda 1.0
def Sphere "ball" {
    double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 40: (0, 1, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DistantLight "sun" {
}
def SphereLight "lamp" {
    float inputs:intensity = 10
    double3 xformOp:translate = (2, 2, 2)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""


@dataclass(frozen=True, slots=True)
class Throughput:
    """Of a batch by some workers. rate: frames a second.  cpu: processor seconds a frame; both with start and end."""

    workers: int
    rate: float
    cpu: float


def measure(counts: Sequence[int]) -> tuple[list[Throughput], float]:
    """The median of the rounds for each number of workers, in turn; and the bytes of a frame's file."""
    rounds: list[list[Throughput]] = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(STAGES):
            Path(folder, f"s{number}.usda").write_text(STAGE)
        for _ in range(ROUNDS):
            rounds.append([_batch(Path(folder), count) for count in counts])
        size = median(path.stat().st_size for path in Path(folder, "out").iterdir())
    found = zip(counts, zip(*rounds, strict=True), strict=True)
    return [Throughput(n, median(t.rate for t in of), median(t.cpu for t in of)) for n, of in found], size


def _batch(folder: Path, workers: int) -> Throughput:
    stages = sorted(map(str, folder.glob("*.usda")))
    command = [sys.executable, "-m", "defshade_cli.cli", "batch", *stages, "--frames", f"1:{FRAMES}"]
    command += ["--size", "640x360", "--workers", str(workers), "-q", "-o", f"{folder}/out/{{scene}}.#.exr"]
    before, start = children_seconds(), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=os.environ | {"LP_NUM_THREADS": "0"})
    frames = STAGES * FRAMES
    return Throughput(workers, frames / (time.perf_counter() - start), (children_seconds() - before) / frames)


def children_seconds() -> float:
    """Of the processor, by all children that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


if __name__ == "__main__":
    of_each, frame_bytes = measure([int(argument) for argument in sys.argv[1:]] or [1, 2])
    for found in of_each:
        gain = found.rate / of_each[0].rate
        print(f"{found.workers} workers: {found.rate:.2f} frames a second, {gain:.2f}x; {found.cpu:.3f} CPU-s a frame")
    print(f"{frame_bytes / 1e3:.0f} kB a frame")
