"""Frames a second of a batch by its number of workers, each with one thread of llvmpipe: `make bench-farm`.

python benchmarks/throughput.py [WORKERS...]
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

STAGES, FRAMES, ROUNDS = 8, 40, 3
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
    rates: dict[int, list[float]] = {count: [] for count in counts}
    with tempfile.TemporaryDirectory() as folder:
        for number in range(STAGES):
            Path(folder, f"s{number}.usda").write_text(STAGE)
        for _ in range(ROUNDS):
            for count in counts:
                rates[count].append(_rate(Path(folder), count))
    for count in counts:
        rate = median(rates[count])
        print(f"{count} workers: {rate:.2f} frames a second, {rate / median(rates[counts[0]]):.2f}x")


def _rate(folder: Path, workers: int) -> float:
    """Frames a second of one batch, start-up and the end included."""
    stages = sorted(map(str, folder.glob("*.usda")))
    command = [sys.executable, "-m", "defshade_cli.cli", "batch", *stages, "--frames", f"1:{FRAMES}"]
    command += ["--size", "640x360", "--workers", str(workers), "-q", "-o", f"{folder}/out/{{scene}}.#.exr"]
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=os.environ | {"LP_NUM_THREADS": "0"})
    return STAGES * FRAMES / (time.perf_counter() - start)


if __name__ == "__main__":
    main([int(argument) for argument in sys.argv[1:]] or [1, 2])
