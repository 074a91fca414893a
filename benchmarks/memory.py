"""Resident memory over many frames of one prim that moves, as one process renders them.

    python benchmarks/memory.py FOLDER [FRAMES]

FRAMES, 1000 by default, lie between those of the stage `animated`, so that each differs from the last.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from bench_stages import FRAMES, generate

_SETTLED = 50
"""Frames, after which memory should not grow."""


def resident(stage: Path, folder: Path, frames: int) -> Iterator[tuple[int, float]]:
    """(frames written, MiB) twice a second."""
    step = f"1:{FRAMES}x{FRAMES / frames:g}"
    command = [sys.executable, "-m", "defshade_cli.cli", "render", str(stage), "-o", str(folder / "f.{frame}.exr")]
    process = subprocess.Popen([*command, "--frames", step, "--size", "320x180", "--quiet"], stdout=subprocess.DEVNULL)
    status = Path(f"/proc/{process.pid}/status")
    while process.poll() is None:
        lines = [line for line in status.read_text().splitlines() if line.startswith("VmRSS")]
        yield len(list(folder.glob("*.exr"))), sum(int(line.split()[1]) / 1024 for line in lines)
        time.sleep(0.5)
    if process.returncode:
        sys.exit(f"render ended with {process.returncode}")


def main(folder: Path, frames: int) -> None:
    stage = generate(folder, "animated")
    images = stage.parent / "memory"
    images.mkdir(exist_ok=True)
    for old in images.glob("*.exr"):
        old.unlink()
    taken = [mib for written, mib in resident(stage, images, frames) if written >= _SETTLED and mib]
    tenth = max(len(taken) // 10, 1)
    first, last = statistics.mean(taken[:tenth]), statistics.mean(taken[-tenth:])
    print(f"{frames} frames, {min(taken):.0f} to {max(taken):.0f} MiB: a mean of {first:.0f} in the first tenth,")
    print(f"{last:.0f} in the last, {last / first - 1:+.1%}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1000)
