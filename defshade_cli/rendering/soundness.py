"""After each frame: what its values are, and where one is no number, which prim and which light it comes from."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.image.film import Film
from defshade_cli.image.layers import BEAUTY, LAYERS
from defshade_cli.image.soundness import FrameCheck, check, filled
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import OnNan, RenderSettings

log = logging.getLogger("defshade")

_MOST_LIGHTS = 64
"""Lights that are tried alone, a pixel each."""

OddPixels = Mapping[str, NDArray[np.bool_]]


@dataclass(frozen=True, slots=True, eq=False)
class Sound:
    """film: as it is to be written.  fault: what was found, one sentence; empty where all values are numbers."""

    film: Film
    fault: str = ""


def sound(film: Film, scene: Scene, settings: RenderSettings, pipeline: Pipeline, on_nan: OnNan) -> Sound:
    """The film after its check, whose findings go to the log; filled where that is asked.

    Raises UsageError, as make_plan does.
    """
    found = check(film)
    log.info("%s", found)
    if found.is_black:
        log.warning("the image is black: no light reaches what the camera sees")
    if not found.odd:
        return Sound(film)
    fault = _described(found.odd) + _traced(found, scene, settings, pipeline, film)
    if on_nan == "fill":
        log.warning("%s; the nearest sound pixels take their place", fault)
        return Sound(filled(film, found.odd))
    if on_nan == "warn":
        log.warning("%s", fault)
    return Sound(film, fault)


def _described(odd: OddPixels) -> str:
    layers = ", ".join(f"{np.count_nonzero(mask)} pixels of {name}" for name, mask in odd.items())
    return f"NaN or infinity in {layers}"


def _traced(found: FrameCheck, scene: Scene, settings: RenderSettings, pipeline: Pipeline, film: Film) -> str:
    """The first odd pixel, what it shows and, of a beauty, the light without which it would not be odd."""
    name, mask = next(iter(found.odd.items()))
    y, x = (int(where[0]) for where in np.nonzero(mask))
    place = x + film.origin[0], y + film.origin[1]
    crop = replace(settings, crop=(*place, 1, 1), size=film.display_size, width=None, max_error=None, time_limit=None)
    prim = _prim_at(scene, crop, pipeline)
    where = f": {name} at pixel {place[0]},{place[1]}" + (f", which shows {prim}" if prim else "")
    if LAYERS[name].source != "lighting":
        return where
    light = _light_at(scene, crop, pipeline)
    return where + (f", lit by {light}" if light else "")


def _prim_at(scene: Scene, crop: RenderSettings, pipeline: Pipeline) -> str:
    film = pipeline.render(scene, make_plan(scene, replace(crop, layers=("primId",), samples=1)))
    number = int(film.layers["primId"][0, 0, 0])
    return film.manifests["primId"].get(number, "")


def _light_at(scene: Scene, crop: RenderSettings, pipeline: Pipeline) -> str:
    """The first light that alone makes the pixel odd."""
    for light in scene.lights[:_MOST_LIGHTS]:
        alone = replace(scene, lights=(light,))
        pixel = pipeline.render(alone, make_plan(alone, replace(crop, layers=(BEAUTY,)))).layers[BEAUTY]
        if not np.isfinite(pixel).all():
            return light.path
    return ""
