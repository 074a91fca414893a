"""Whole processes on the same stages: ours and those of the peers that are installed, in alternating rounds.

    python benchmarks/compare.py FOLDER [--stages simple,heavy] [--size 1920x1080] [--rounds 3] [--page PAGE.md]

Stages are generated in FOLDER, and converted for peers that read no USD; neither is timed. --python names the
interpreter of the peers, where they live in an environment of their own. Of each process the processor seconds, the
wall time and the peak of resident memory are the kernel's own figures; medians of the rounds count, after one
that warms up: Python's modules and shaders are compiled then, as an installation has them.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from bench_stages import GENERATED, generate
from glb import write_glb

from defshade_cli.measure.sections import replace_generated

PEERS = Path(__file__).parent / "peers"
LIMIT = 600.0
"""Seconds, after which a process is ended and counts as not having rendered."""

Command = Callable[[Path, Path], list[str]]


@dataclass(frozen=True, slots=True)
class Usage:
    """wall, cpu: seconds.  peak: MiB resident."""

    wall: float
    cpu: float
    peak: float


@dataclass(frozen=True, slots=True)
class Tool:
    """command: of (stage, image).  suffix: of the stage's file.  module: what must be importable; empty for ours.

    leaves_out: what of the stage its picture lacks.
    """

    name: str
    command: Command
    suffix: str = ".usdc"
    image: str = ".png"
    module: str = ""
    leaves_out: str = ""


def tools(size: tuple[int, int], python: str) -> list[Tool]:
    """Ours first, then the peers that `python` can import."""
    side = [str(length) for length in size]

    def ours(*options: str) -> Command:
        render = [sys.executable, "-m", "defshade_cli.cli", "render", "--quiet", "--size", "x".join(side), *options]
        return lambda stage, image: [*render, str(stage), "-o", str(image)]

    def peer(name: str, *arguments: str, runs: str = python) -> Command:
        return lambda stage, image: [runs, str(PEERS / f"render_{name}.py"), str(stage), str(image), *side, *arguments]

    falloff = "shadows, falloff, areas of lights, USD"
    floor = [sys.executable, str(PEERS.parent / "floor.py")]
    known = [
        Tool("floor: imports, context, one draw, one PNG", lambda _, image: [*floor, str(image), "x".join(side)]),
        Tool("defshade, 1 sample, no shadows", ours("--no-shadows"), leaves_out="shadows"),
        Tool("defshade, 1 sample", ours()),
        Tool("VTK", peer("vtk"), ".glb", module="vtkmodules", leaves_out=falloff),
        Tool("F3D", peer("f3d"), ".glb", module="f3d", leaves_out=falloff),
        Tool("pyrender", peer("pyrender"), ".glb", module="pyrender", leaves_out="shadows, areas, lights past 4, USD"),
        Tool("Mitsuba `direct`, 16 spp", peer("mitsuba", "16", runs=sys.executable), image=".exr", module="mitsuba"),
        Tool("Cycles, 16 samples, direct", peer("bpy", "16", "cycles"), image=".exr", module="bpy"),
        Tool("EEVEE, 16 samples", peer("bpy", "16", "eevee"), image=".exr", module="bpy"),
    ]
    return [tool for tool in known if not tool.module or _imports(tool, python)]


def measure(command: Sequence[str]) -> Usage | None:
    """Run to its end; None where it fails or takes longer than LIMIT."""
    start = time.perf_counter()
    paths = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))} if _is_ours(command) else {}
    environment = os.environ | {"PYOPENGL_PLATFORM": "egl"} | paths
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    ended, usage = _wait(process, start + LIMIT)
    if ended != 0:
        return None
    return Usage(time.perf_counter() - start, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)


def compare(folder: Path, names: Iterable[str], chosen: Sequence[Tool], rounds: int) -> dict[str, dict[str, Usage]]:
    """Medians by stage and tool; tools that fail are left out."""
    results: dict[str, dict[str, Usage]] = {}
    for name in names:
        stage = generate(folder, name)
        if any(tool.suffix == ".glb" for tool in chosen):
            write_glb(stage, stage.with_suffix(".glb"))
        usages: dict[str, list[Usage | None]] = {tool.name: [] for tool in chosen}
        for number in range(-1, rounds):
            for tool in chosen:
                image = stage.parent / f"{tool.name.replace(' ', '_').replace('`', '')}{tool.image}"
                used = measure(tool.command(stage.with_suffix(tool.suffix), image))
                print(name, number, tool.name, used, file=sys.stderr, flush=True)
                if number >= 0:
                    usages[tool.name].append(used)
        results[name] = {tool: _median(taken) for tool, taken in usages.items() if all(taken)}
    return results


def table(results: dict[str, dict[str, Usage]], chosen: Sequence[Tool]) -> str:
    """Markdown: a row a tool; wall s / CPU-seconds / peak MiB a stage."""
    lines = ["| | " + " | ".join(results) + " | leaves out |", "|---|" + "---:|" * len(results) + "---|"]
    for tool in chosen:
        cells = [_cell(by_tool.get(tool.name)) for by_tool in results.values()]
        lines.append(f"| {tool.name} | " + " | ".join(cells) + f" | {tool.leaves_out} |")
    return "\n".join(lines)


def _cell(usage: Usage | None) -> str:
    return f"{usage.wall:.2f} / {usage.cpu:.2f} / {usage.peak:.0f}" if usage else "failed"


def _wait(process: subprocess.Popen[bytes], deadline: float) -> tuple[int, resource.struct_rusage]:
    """Exit status and the kernel's account of the process and all its threads."""
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, usage
        if time.perf_counter() > deadline:
            process.kill()
        time.sleep(0.005)


def _median(usages: Sequence[Usage | None]) -> Usage:
    taken = [usage for usage in usages if usage]
    return Usage(*(statistics.median(getattr(usage, field) for usage in taken) for field in ("wall", "cpu", "peak")))


def _imports(tool: Tool, python: str) -> bool:
    interpreter = sys.executable if tool.module == "mitsuba" else python
    code = f"import importlib.util, sys; sys.exit(importlib.util.find_spec('{tool.module}') is None)"
    return subprocess.run([interpreter, "-c", code]).returncode == 0


def _is_ours(command: Sequence[str]) -> bool:
    return command[0] == sys.executable


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--stages", default="simple,manylights,heavy")
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--only", default="", help="tools whose names hold one of these, with commas between")
    parser.add_argument("--page", type=Path, help="write the table into this page in place of printing it")
    parser.add_argument("--block", default="peers", help="the page's block that the table replaces")
    asked = parser.parse_args()
    width, height = map(int, asked.size.split("x"))
    names = [name for name in asked.stages.split(",") if name in GENERATED]
    wanted = asked.only.split(",")
    chosen = [t for t in tools((width, height), asked.python) if any(part in t.name for part in wanted)]
    results = compare(asked.folder, names, chosen, asked.rounds)
    load = os.getloadavg()[1]
    note = f"{width}x{height}, {asked.rounds} rounds, {os.cpu_count()} cores of {platform.machine()}, load {load:.0f}."
    content = f"{note}\n\n{table(results, chosen)}"
    if asked.page:
        asked.page.write_text(replace_generated(asked.page.read_text("utf-8"), asked.block, content), "utf-8")
    else:
        print(content)


if __name__ == "__main__":
    main()
