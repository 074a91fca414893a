"""What a frame costs by the number of its lights, as volumes and by tiles.

    python benchmarks/lights.py [WIDTHxHEIGHT] [--page PAGE.md]

The more lights there are over a plane, the shorter each reaches, so that together they cover as many pixels: a fair
renderer takes as long for 10,000 as for 16. In the last row they all reach everything.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from lights_plot import draw_plot

from defshade_cli.gpu.context import Gpu
from defshade_cli.measure.sections import replace_generated
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.plan.cost import covered_share
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.geometry import Drawable, Mesh, Subset
from defshade_cli.scene.light import SphereLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import Lighting, RenderSettings
from defshade_cli.spaces import translation

COUNTS = (16, 64, 256, 1024, 4096, 10_000)
TOLERANCE = 1e-3
HALF = 10.0
"""Of the plane's side, scene units."""
RADIUS = 1e-3
MOST_WHOLE = 256
"""Lights that the whole image is tried with."""


def scene_of(count: int, reach: float) -> Scene:
    """`count` lights a tenth of their reach above a plane that fills the image."""
    side = math.isqrt(count - 1) + 1
    x, y = ((2.0 * (axis + 0.5) / side - 1.0) * HALF for axis in np.divmod(np.arange(count), side))
    gain = (0.5 / math.pi + 1.0 / math.pi) * count / TOLERANCE
    nits = reach**2 / gain / (math.pi * RADIUS**2)
    places = [translation(np.array([*place, 0.1 * reach])) for place in zip(x, y, strict=True)]
    lights = tuple(
        SphereLight(path=f"/light_{i}", world_from_light=place, color=(1, 1, 1), intensity=nits, radius=RADIUS)
        for i, place in enumerate(places)
    )
    corners = [[-HALF, -HALF, 0], [HALF, -HALF, 0], [HALF, HALF, 0], [-HALF, HALF, 0]]
    mesh = Mesh("/plane", corners, [[0, 0, 1]] * 4, [[0, 1, 2], [0, 2, 3]], [0, 0])
    once = np.zeros(1, np.int32), np.full((1, 3), 0.5, np.float32), np.ones(1, np.float32)
    plane = Drawable(0, np.eye(4)[None], (Subset(0, 0, 2),), ("/plane",), *once)
    eye = translation(np.array([0.0, 0.0, 2.0 * HALF]))
    camera = Camera("/camera", eye, (-0.5, 0.5, -0.5, 0.5), clipping_range=(0.1, 100.0))
    grey = Material("/grey", diffuse_color=(0.5, 0.5, 0.5), roughness=1.0)
    return Scene("lights", (mesh,), (plane,), (grey,), lights, camera)


def seconds(pipeline: Pipeline, scene: Scene, settings: RenderSettings, rounds: int = 3) -> float:
    """Processor seconds to draw a frame, the median."""
    plan = make_plan(scene, settings)
    taken = []
    for _ in range(rounds):
        start = time.process_time()
        pipeline.render(scene, plan)
        taken.append(time.process_time() - start)
    return statistics.median(taken)


def row(pipeline: Pipeline, count: int, reach: float, size: tuple[int, int]) -> str:
    scene = scene_of(count, reach)
    settings = RenderSettings(size=size, shadows=False, light_points=1, light_tolerance=TOLERANCE)
    covered = covered_share(make_plan(scene, settings).lights, scene.camera)
    ways: tuple[Lighting, ...] = ("volumes", "tiles", "whole")
    cells = [
        ""
        if way == "whole" and count > MOST_WHOLE
        else f"{seconds(pipeline, scene, replace(settings, lighting=way)):.2f}"
        for way in ways
    ]
    print(count, f"{covered:.1f}", *cells, file=sys.stderr, flush=True)
    return f"| {count:,} | {reach:.2f} | {covered:.1f} | " + " | ".join(cells) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("size", nargs="?", default="1920x1080")
    parser.add_argument("--page", type=Path, help="write the table and its plot into this page, and print neither")
    asked = parser.parse_args()
    width, height = map(int, asked.size.split("x"))
    lines = [
        "| lights | reach | volumes over the image | volumes, CPU-s | tiles, CPU-s | whole image, CPU-s |",
        "|---:|---:|---:|---:|---:|---:|",
    ]
    with Gpu() as gpu:
        pipeline = Pipeline(gpu)
        lines += [row(pipeline, count, HALF / math.sqrt(count) * 2.0, (width, height)) for count in COUNTS]
        lines.append(row(pipeline, 256, 4.0 * HALF, (width, height)))
    content = f"{width}x{height}, CPU-seconds.\n\n" + "\n".join(lines)
    if asked.page:
        asked.page.write_text(replace_generated(asked.page.read_text("utf-8"), "lights", content), "utf-8")
        draw_plot(asked.page)
    else:
        print(content)


if __name__ == "__main__":
    main()
