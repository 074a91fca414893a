"""How noisy Mitsuba `direct` is with 16 samples a pixel, and how many samples of ours are as accurate.

    python benchmarks/errors.py FOLDER [NAME...]

Each is held to its own converged picture, at a small size: in `direct`, emitters hide what stands behind them, and
otherwise the lighting is the same. What a pixel's error is, hardly goes by the number of pixels.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from bench_stages import generate
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.image.compare import compare
from defshade_cli.measure.bench import Sweep, Trial, run_sweep
from defshade_cli.measure.layouts import first_frame
from defshade_cli.measure.mitsuba_plugins import mi
from defshade_cli.measure.pathtraced import mitsuba_world
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.settings import RenderJob, RenderSettings

SIZE = (160, 90)
PEER_SAMPLES, CONVERGED = 16, 512
OURS = (1, 4, 16)


def direct_error(stage: Path) -> float:
    """relMSE of Mitsuba `direct` with PEER_SAMPLES against itself with CONVERGED."""
    scene = first_frame(stage)
    plan = make_plan(scene, RenderSettings(size=SIZE))
    world = mi.load_dict(mitsuba_world(scene, plan, {"type": "direct", "hide_emitters": True}))

    def draw(samples: int, seed: int) -> NDArray:
        return np.array(mi.render(world, spp=samples, seed=seed))[..., :3] * plan.exposure

    return compare(draw(PEER_SAMPLES, 0), draw(CONVERGED, 1), flip=False)[0].rel_mse


def our_errors(pipeline: Pipeline, stage: Path) -> tuple[Trial, ...]:
    sweep = Sweep(("float",), OURS, (True,), rounds=1, reference_samples=CONVERGED, flip=False)
    job = RenderJob(stage, settings=RenderSettings(size=SIZE))
    return run_sweep(pipeline, "", job, sweep, lambda line: print(line, file=sys.stderr, flush=True)).trials


def main(folder: Path, names: list[str]) -> None:
    header = " | ".join(f"defshade {samples}" for samples in OURS)
    print(f"| stage | Mitsuba `direct` {PEER_SAMPLES} | {header} |\n|---|" + "---:|" * (1 + len(OURS)))
    with Gpu() as gpu:
        pipeline = Pipeline(gpu)
        for name in names:
            stage = generate(folder, name)
            errors = [direct_error(stage), *(trial.rel_mse for trial in our_errors(pipeline, stage))]
            print(f"| {name} | " + " | ".join(f"{error:.1e}" for error in errors) + " |", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:] or ["simple", "manylights", "heavy"])
