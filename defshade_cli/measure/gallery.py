"""The figures of the documents, rendered anew: `python -m defshade_cli.measure.gallery FOLDER`."""

from __future__ import annotations

import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np

from defshade_cli.image.files import write
from defshade_cli.image.film import Film
from defshade_cli.rendering import Renderer, run
from defshade_cli.resources import SCENES
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

_GBUFFER = ("albedo", "metallic", "normal", "roughness", "depth", "beauty")
_STRIP = (1, 16, 256)

FIGURES = {
    "gbuffer.png": ("showcase.usda", RenderSettings(width=400, samples=4, layers=_GBUFFER)),
    "volumes.png": ("light_cone.usda", RenderSettings(width=640, samples=4, debug="volumes")),
    "materials.png": ("materials.usda", RenderSettings(width=640, samples=16)),
}
"""File → stage and settings."""


def render_gallery(folder: Path) -> None:
    """Write every figure into `folder`. Raises the errors of errors.py."""
    with Renderer() as renderer:
        for name, (scene, settings) in FIGURES.items():
            film = _film(scene, settings, renderer)
            write(film, OutputSettings(sheet=len(film.layers) > 1), folder / name)
        write(_convergence(renderer), OutputSettings(), folder / "convergence.png")


def _convergence(renderer: Renderer) -> Film:
    """One stage with 1, 16 and 256 samples, side by side."""
    settings = RenderSettings(size=(240, 180), light_points=1)
    films = [_film("light_rect.usda", replace(settings, samples=count), renderer) for count in _STRIP]
    return replace(films[-1], layers={"beauty": np.concatenate([f.layers["beauty"] for f in films], axis=1)}, shown={})


def _film(scene: str, settings: RenderSettings, renderer: Renderer) -> Film:
    with closing(run(RenderJob(SCENES / scene, settings=settings), renderer=renderer)) as results:
        film = next(results).images[0].film
    assert film is not None
    return film


if __name__ == "__main__":
    render_gallery(Path(sys.argv[1]))
