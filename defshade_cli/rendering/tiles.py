"""Images larger than one target: drawn window by window, and joined."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from defshade_cli.errors import GpuMemoryError
from defshade_cli.gpu.draw_list import DrawList
from defshade_cli.image.film import Film
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import Plan, ShutterSample
from defshade_cli.scene.scene import Scene

log = logging.getLogger("defshade")

LARGEST = 4096
"""Pixels a side: a target of a full GBuffer takes some 200 bytes a pixel, so 3.4 GB."""
_SMALLEST = 64

Moments = Callable[[], Iterator[ShutterSample]]


def render(
    pipeline: Pipeline, scene: Scene, plan: Plan, moments: Moments, uploaded: DrawList, before: Film | None = None
) -> Film:
    """The plan's film, in tiles where it is larger than LARGEST, and in smaller ones where memory ends.

    moments: begins the shutter's anew.  before: as Pipeline.render has it; what is drawn in tiles is drawn whole.
    Raises GpuError, GpuMemoryError where the smallest tile does not fit.
    """
    side = min(LARGEST, pipeline.largest_side)
    while True:
        try:
            return _in_tiles(pipeline, scene, plan, moments, uploaded, side, before)
        except GpuMemoryError as error:
            side = min(side, max(plan.size)) // 2
            if side < _SMALLEST:
                raise
            log.warning("%s; the image is drawn in tiles of %d pixels", error, side)


def _in_tiles(
    pipeline: Pipeline,
    scene: Scene,
    plan: Plan,
    moments: Moments,
    uploaded: DrawList,
    side: int,
    before: Film | None,
) -> Film:
    windows = plan.window.tiles(side)
    if len(windows) == 1:
        return pipeline.render(scene, plan, moments(), uploaded, before)
    log.info("drawn in %d tiles", len(windows))
    films = []
    for window in windows:
        seen = ((then, at.within(window)) for then, at in moments())
        films.append(pipeline.render(scene, plan.within(window), seen))
    return joined(films, plan)


def joined(films: Sequence[Film], plan: Plan) -> Film:
    """One film of the plan's window from those of its tiles."""
    width, height = plan.size
    layers = {}
    for name, pixels in films[0].layers.items():
        layers[name] = np.empty((height, width, pixels.shape[2]), np.float32)
        for film in films:
            x, y = film.origin[0] - plan.window.x, film.origin[1] - plan.window.y
            layers[name][y : y + film.size[1], x : x + film.size[0]] = film.layers[name]
    manifests = {
        name: {number: path for film in films for number, path in film.manifests[name].items()}
        for name in films[0].manifests
    }
    return replace(
        films[0],
        layers=layers,
        manifests=manifests,
        origin=plan.window.origin,
        samples=max(film.samples for film in films),
        metadata=_joined_facts(films),
    )


def _joined_facts(films: Sequence[Film]) -> dict[str, object]:
    """Sampling's facts of all tiles together: image.film.Sampling."""
    facts = [film.metadata for film in films]
    if not facts[0]:
        return {}
    shares = np.array([film.size[0] * film.size[1] for film in films], float)
    errors = [each["error"] for each in facts]
    stops = [each["stopped_by"] for each in facts]
    return {
        "samples": max(each["samples"] for each in facts),
        "samples_min": min(each["samples_min"] for each in facts),
        "samples_mean": round(float(np.average([each["samples_mean"] for each in facts], weights=shares)), 2),
        "error": None if None in errors else max(errors),
        "stopped_by": next((stop for stop in ("time-limit", "samples") if stop in stops), stops[0]),
    }
