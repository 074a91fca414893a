"""How far renderers with 16 samples a pixel are from their limits, and few samples of ours from ours.

    python benchmarks/errors.py FOLDER [--stages simple,heavy,manylights] [--python INTERPRETER] [--page PAGE.md]

Each is held to its own converged picture, for lighting models differ; at a small size, which a pixel's error hardly
depends on. relMSE has a heavy tail, of the few pixels that a highlight met: the median of SEEDS pictures counts.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from bench_stages import generate
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.image.compare import compare
from defshade_cli.image.reading import read
from defshade_cli.measure.bench import Sweep, Trial, run_sweep
from defshade_cli.measure.layouts import first_frame
from defshade_cli.measure.mitsuba_plugins import mi
from defshade_cli.measure.pathtraced import mitsuba_world
from defshade_cli.measure.sections import replace_generated
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.settings import RenderJob, RenderSettings

SIZE = (160, 90)
SAMPLES, SEEDS = 16, 5
OURS, CONVERGED = (1, 2, 8, 16), {"simple": 1024, "heavy": 64, "manylights": 64}

Draw = Callable[[int, int], NDArray[np.float32]]
"""(samples, seed) → (H, W, 3)."""


def mitsuba(stage: Path) -> Draw:
    """Our lighting model, but that emitters hide what stands behind them."""
    scene = first_frame(stage)
    plan = make_plan(scene, RenderSettings(size=SIZE))
    world = mi.load_dict(mitsuba_world(scene, plan, {"type": "direct", "hide_emitters": True}))
    return lambda samples, seed: np.array(mi.render(world, spp=samples, seed=seed))[..., :3] * plan.exposure


def blender(stage: Path, python: str, engine: str) -> Draw:
    """EEVEE knows no seeds: its pictures are equal."""
    script, image = Path(__file__).parent / "peers" / "render_bpy.py", stage.parent / f"{engine}.exr"

    def draw(samples: int, seed: int) -> NDArray[np.float32]:
        arguments = map(str, (script, stage, image, *SIZE, samples, engine, seed))
        subprocess.run([python, *arguments], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return read(image)["beauty"][..., :3]

    return draw


def error_of(draw: Draw, converged: int, seeds: int = SEEDS) -> float:
    """relMSE with SAMPLES."""
    limit = draw(converged, 1000)
    return statistics.median(compare(draw(SAMPLES, seed), limit, flip=False)[0].rel_mse for seed in range(seeds))


def our_errors(pipeline: Pipeline, stage: Path) -> tuple[Trial, ...]:
    """Without shadows and with, against a picture with shadows."""
    sweep = Sweep(
        ("float",), OURS, (False, True), rounds=1, reference_samples=CONVERGED.get(stage.stem, 64), flip=False
    )
    job = RenderJob(stage, settings=RenderSettings(size=SIZE))
    return run_sweep(pipeline, "", job, sweep, lambda line: print(line, file=sys.stderr, flush=True)).trials


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--stages", default="simple,heavy,manylights")
    parser.add_argument("--python", default="", help="an interpreter that has bpy")
    parser.add_argument("--page", type=Path, help="write the table into this page in place of printing it")
    asked = parser.parse_args()
    names = [
        f"Mitsuba `direct`, {SAMPLES} spp",
        *(f"{name}, {SAMPLES}" for name in ("Cycles", "EEVEE") if asked.python),
    ]
    names += [f"defshade, {count}{kind}" for count in OURS for kind in (", no shadows", "")]
    lines = ["| relMSE | " + " | ".join(names) + " |", "|---|" + "---:|" * len(names)]
    with Gpu() as gpu:
        pipeline = Pipeline(gpu)
        for name in asked.stages.split(","):
            stage = generate(asked.folder, name)
            errors = [error_of(mitsuba(stage), 4096)]
            if asked.python:
                errors += [error_of(blender(stage, asked.python, "cycles"), 4096)]
                errors += [error_of(blender(stage, asked.python, "eevee"), 512, seeds=1)]
            errors += [trial.rel_mse for trial in our_errors(pipeline, stage)]
            lines.append(f"| {name} | " + " | ".join(f"{error:.1e}" for error in errors) + " |")
            print(lines[-1], file=sys.stderr, flush=True)
    if asked.page:
        asked.page.write_text(replace_generated(asked.page.read_text("utf-8"), "errors", "\n".join(lines)), "utf-8")
    else:
        print("\n".join(lines))


if __name__ == "__main__":
    main()
