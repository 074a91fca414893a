"""Frames a second of a batch by its number of workers, each with one thread of llvmpipe: `make bench-farm`.

python benchmarks/throughput.py [WORKERS...]
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

STAGES, FRAMES, ROUNDS = 8, 20, 3
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


def main(counts: list[int]) -> None:
    found: dict[int, list[tuple[float, float]]] = {count: [] for count in counts}
    with tempfile.TemporaryDirectory() as folder:
        for number in range(STAGES):
            Path(folder, f"s{number}.usda").write_text(STAGE)
        for _ in range(ROUNDS):
            for count in counts:
                found[count].append(_batch(Path(folder), count))
        frame = median(path.stat().st_size for path in Path(folder, "out").iterdir())
    first = median(rate for rate, _ in found[counts[0]])
    for count in counts:
        rate, cpu = (median(values) for values in zip(*found[count], strict=True))
        print(f"{count} workers: {rate:.2f} frames a second, {rate / first:.2f}x; {cpu:.3f} processor seconds a frame")
    print(f"{frame / 1e3:.0f} kB a frame")


def _batch(folder: Path, workers: int) -> tuple[float, float]:
    """Frames a second of one batch, and its processor seconds a frame, start-up and the end included."""
    stages = sorted(map(str, folder.glob("*.usda")))
    command = [sys.executable, "-m", "defshade_cli.cli", "batch", *stages, "--frames", f"1:{FRAMES}"]
    command += ["--size", "640x360", "--workers", str(workers), "-q", "-o", f"{folder}/out/{{scene}}.#.exr"]
    before, start = children_seconds(), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=os.environ | {"LP_NUM_THREADS": "0"})
    frames = STAGES * FRAMES
    return frames / (time.perf_counter() - start), (children_seconds() - before) / frames


def children_seconds() -> float:
    """Of the processor, by all children that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


if __name__ == "__main__":
    main([int(argument) for argument in sys.argv[1:]] or [1, 2])
