"""What a batch costs here beside its frames, and the arithmetic to a million of them: `make bench-farm`.

    python benchmarks/farm.py [--page PAGE.md]

By the clock, so the machine should be idle: a minute or two on two cores.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import chunks
import dask_scale
import throughput

from defshade_cli.farm.tasks import LARGEST_CHUNK, check_batch
from defshade_cli.measure.sections import replace_generated
from defshade_cli.settings import OutputSettings, RenderJob

FRAMES, HOSTS, WORKERS_A_HOST = 1_000_000, 1000, 2
_PLANNED = 20_000
_HEAVY_SECONDS, _HEAVY_BYTES = 60.0, 8e6


@dataclass(frozen=True, slots=True)
class Costs:
    """What was measured. load: of the machine before, in processes that want a core.

    planning: seconds a frame before a batch's first.  size: bytes of a frame's file.
    """

    load: float
    rates: Sequence[throughput.Throughput]
    size: float
    chunk: chunks.ChunkCost
    planning: float
    simulation: dask_scale.Simulation


def measure() -> Costs:
    """The whole; the simulation's tasks take as long as a chunk of the frames measured."""
    load = os.getloadavg()[0]
    rates, size = throughput.measure([1, 2])
    chunk = chunks.measure(2)
    simulation = dask_scale.simulate(3000, round(LARGEST_CHUNK * rates[0].cpu, 1))
    return Costs(load, rates, size, chunk, _planning(), simulation)


def _planning() -> float:
    jobs = [
        RenderJob(
            Path(f"{number}.usda"), tuple(map(float, range(100))), output=OutputSettings(patterns=("{scene}.#.exr",))
        )
        for number in range(_PLANNED // 100)
    ]
    start = time.perf_counter()
    check_batch(jobs)
    return (time.perf_counter() - start) / _PLANNED


def tables(costs: Costs) -> str:
    """What was measured, and what follows for a farm, as Markdown."""
    return "\n".join([*_measured(costs), "", *_arithmetic(costs)])


def _measured(costs: Costs) -> list[str]:
    one, simulation = costs.rates[0], costs.simulation
    rows = [("other work here: load average before", f"{costs.load:.1f}")]
    for found in costs.rates:
        name = "one worker" if found.workers == 1 else f"{found.workers} workers"
        gain = f"{found.rate:.2f} frames a second, {found.rate / one.rate:.2f}x"
        rows.append((name, f"{gain}; {found.cpu:.3f} CPU-s a frame, start and end included"))
    rows += [
        ("a frame's file", f"{costs.size / 1e3:.0f} kB"),
        ("a chunk more", f"{1e3 * costs.chunk.wall:.1f} ms, {1e3 * costs.chunk.cpu:.1f} CPU-ms"),
        ("planning a frame", f"{1e6 * costs.planning:.0f} µs"),
        (
            f"{simulation.tasks:,} sleeping tasks of {simulation.seconds:g} s on 1,000 threads of Dask",
            f"{simulation.taken:.1f} s, ideally {simulation.ideal:.1f} s; submitted in {simulation.submitted:.1f} s; "
            f"{1e3 * simulation.cpu / simulation.tasks:.2f} CPU-ms a task",
        ),
    ]
    return ["| measured | |", "|---|---:|", *(f"| {name} | {value} |" for name, value in rows)]


def _arithmetic(costs: Costs) -> list[str]:
    """A million frames on a thousand hosts, of the frames measured and of heavy ones."""
    task = costs.simulation.cpu / costs.simulation.tasks
    count = FRAMES // LARGEST_CHUNK
    kinds = [(costs.rates[0].cpu, costs.size), (_HEAVY_SECONDS, _HEAVY_BYTES)]
    hours = [FRAMES * seconds / (HOSTS * WORKERS_A_HOST) / 3600 for seconds, _ in kinds]
    rows = [
        ("rendering, hours", [f"{hour:.2f}" for hour in hours]),
        ("chunks' own cost, of the rendering", [f"{costs.chunk.wall / (LARGEST_CHUNK * s):.2%}" for s, _ in kinds]),
        ("planning, minutes in one process", [f"{FRAMES * costs.planning / 60:.1f}"] * 2),
        ("one Dask scheduler, minutes", [f"{count * task / 60:.1f}"] * 2),
        ("workers that it keeps busy", [f"{LARGEST_CHUNK * seconds / task:,.0f}" for seconds, _ in kinds]),
        ("files, GB", [f"{FRAMES * size / 1e9:,.0f}" for _, size in kinds]),
        (
            "writing, MB a second",
            [f"{FRAMES * n / 1e6 / 3600 / hour:,.0f}" for (_, n), hour in zip(kinds, hours, strict=True)],
        ),
        ("files made, a second", [f"{FRAMES / 3600 / hour:,.0f}" for hour in hours]),
    ]
    names = [f"{seconds:.3g} s and {size / 1e6:.2g} MB a frame" for seconds, size in kinds]
    head = [
        f"| {FRAMES:,} frames, {HOSTS:,} hosts of {WORKERS_A_HOST} cores | {' | '.join(names)} |",
        "|---|---:|---:|",
    ]
    return head + [f"| {name} | {' | '.join(values)} |" for name, values in rows]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", type=Path, help="write the tables into this page in place of printing them")
    page = parser.parse_args().page
    content = tables(measure())
    if page:
        page.write_text(replace_generated(page.read_text("utf-8"), "scale", content), "utf-8")
    else:
        print(content)


if __name__ == "__main__":
    main()
