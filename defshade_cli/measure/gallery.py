"""The figures of the documents, rendered anew: `python -m defshade_cli.measure.gallery FOLDER`."""

from __future__ import annotations

import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.image.compare import compare
from defshade_cli.image.files import write
from defshade_cli.image.film import Film
from defshade_cli.image.layers import BEAUTY, LAYERS, Layer
from defshade_cli.measure.bench import Sweep, run_sweep
from defshade_cli.measure.bench.plot import plot
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.rendering import Renderer, run
from defshade_cli.resources import SCENES
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

_GBUFFER = ("albedo", "metallic", "normal", "roughness", "depth", "beauty")
_STRIP, _LIMIT = (1, 16, 256), 1024
_AMPLIFIED = 4.0
_SOFT_LIGHT = "light_rect.usda"

FIGURES = {
    "showcase.png": ("showcase.usda", RenderSettings(width=1280, samples=16)),
    "gbuffer.png": ("showcase.usda", RenderSettings(width=400, samples=16, layers=_GBUFFER)),
    "volumes.png": ("light_cone.usda", RenderSettings(width=640, samples=16, debug="volumes")),
    "materials.png": ("materials.usda", RenderSettings(width=800, samples=64, exposure=1.0)),
}
"""File → stage and settings."""


def render_gallery(folder: Path) -> None:
    """Write every figure into `folder`. Raises the errors of errors.py."""
    with Renderer() as renderer:
        for name, (scene, settings) in FIGURES.items():
            film = _film(scene, settings, renderer)
            write(film, OutputSettings(sheet=len(film.layers) > 1), folder / name)
        write(_convergence(renderer), OutputSettings(sheet=True), folder / "convergence.png")
    (folder / "pareto.svg").write_text(_pareto(), encoding="utf-8")


def _convergence(renderer: Renderer) -> Film:
    """One stage with 1, 16 and 256 samples, and what each is off from many more, as labelled tiles."""
    settings = RenderSettings(size=(320, 192), light_points=1)
    limit = _film(_SOFT_LIGHT, replace(settings, samples=_LIMIT), renderer).layers[BEAUTY]
    layers: dict[str, NDArray[np.float32]] = {}
    rows: dict[str, Layer] = {}
    for count in _STRIP:
        film = _film(_SOFT_LIGHT, replace(settings, samples=count), renderer)
        beauty = film.layers[BEAUTY]
        (error,) = compare({BEAUTY: beauty[..., :3]}, {BEAUTY: limit[..., :3]})
        flip = "" if error.flip is None else f", FLIP {error.flip:.3f}"
        shown = {
            f"{count} sample{'s' * (count > 1)}": (beauty, f"relMSE {error.rel_mse:.1e}{flip}"),
            f"off by, at {count}": (_off_by(beauty, limit), f"difference to {_LIMIT} samples, times {_AMPLIFIED:g}"),
        }
        layers |= {name: pixels for name, (pixels, _) in shown.items()}
        rows |= {name: replace(LAYERS[BEAUTY], name=name, summary=summary) for name, (_, summary) in shown.items()}
    return replace(film, layers=layers, rows=rows, shown={})


def _off_by(beauty: NDArray[np.float32], limit: NDArray[np.float32]) -> NDArray[np.float32]:
    """(H, W, 4) the difference of the colours of (H, W, 4) pictures, opaque."""
    off = _AMPLIFIED * np.abs(beauty - limit)
    off[..., 3] = 1.0
    return off


def _pareto() -> str:
    """An SVG document: what `bench` finds of the stage of the strip."""
    job = RenderJob(SCENES / _SOFT_LIGHT, settings=RenderSettings(size=(240, 135)))
    with Gpu() as gpu:
        bench = run_sweep(
            Pipeline(gpu), gpu.renderer, job, Sweep(rounds=1, reference_samples=512, flip=False), say=lambda _: None
        )
    return plot(bench, "cpu")


def _film(scene: str, settings: RenderSettings, renderer: Renderer) -> Film:
    with closing(run(RenderJob(SCENES / scene, settings=settings), renderer=renderer)) as results:
        film = next(results).images[0].film
    assert film is not None
    return film


if __name__ == "__main__":
    render_gallery(Path(sys.argv[1]))
