"""What a corner came to: its worst error against the reference, where, and what was no number."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import StageError
from defshade_cli.measure.layouts import first_frame
from defshade_cli.measure.reference import reference_radiance
from defshade_cli.measure.stress.corner import Corner
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.settings import RenderSettings

BOUND = 1e-3
"""Relative error that the float layout keeps wherever the exact value can be held in float32."""
_FLOOR = 1e-3
_LEAST = 1e5 * float(np.finfo(np.float32).tiny)
"""Light before exposure that float32 holds, with what it is a product of: five digits above its least normal number."""
_MOST_SHADOWED = 1000
_LAYERS = ("beauty", "depth", "normal", "position")


@dataclass(frozen=True, slots=True)
class Verdict:
    """worst: relative to the pixel's reference.  where: that pixel, (x, y).  odd: values that are NaN or infinite.

    lit: pixels that the reference gives light.  error: what stood in the place of an image.
    """

    corner: Corner
    worst: float = 0.0
    where: tuple[int, int] = (0, 0)
    odd: int = 0
    lit: int = 0
    error: str = ""

    @property
    def is_sound(self) -> bool:
        """Whether nothing odd was seen and the error is within bounds, or has its reason."""
        return not self.odd and (self.worst <= BOUND or bool(self.corner.why))


def judge(corner: Corner, pipeline: Pipeline, folder: Path) -> Verdict:
    """Render the corner, whose stage is written to `folder`."""
    path = folder / "corner.usda"
    path.write_text(corner.stage.text(), "utf-8")
    settings = replace(corner.settings, layers=_LAYERS)
    try:
        scene = first_frame(path)
        plan = make_plan(scene, settings)
        film = pipeline.render(scene, plan)
    except StageError as error:
        return Verdict(corner, error=str(error))
    lights = [planned.light for planned in plan.lights]
    exact, covered = reference_radiance(pipeline.planes(scene, plan), plan.camera, lights)
    image = film.layers["beauty"][..., :3]
    sampled = pipeline.render(scene, make_plan(scene, _sampled(settings, len(lights)))).layers["beauty"]
    shown = [image, sampled, *(film.layers[name][covered] for name in _LAYERS[1:])]
    odd = sum(int(np.count_nonzero(~np.isfinite(values))) for values in shown)
    worst, where, lit = _worst(image, exact, plan.camera.exposure)
    return Verdict(corner, worst, where, odd, lit)


def _sampled(settings: RenderSettings, lights: int) -> RenderSettings:
    """What the reference does not know: it must be finite all the same. A light has up to six shadow maps a sample."""
    shadows = lights <= _MOST_SHADOWED
    return replace(settings, layers=("beauty",), samples=2, shadows=shadows, light_points=2)


def _worst(image: NDArray[Any], exact: NDArray[np.float64], exposure: float) -> tuple[float, tuple[int, int], int]:
    level = exact.mean(axis=-1)
    lit = level > max(_FLOOR * level.max(initial=0.0), _LEAST * max(1.0, exposure))
    if not lit.any():
        return 0.0, (0, 0), 0
    apart = np.abs(image.astype(np.float64) - exact).max(axis=-1)
    errors = np.nan_to_num(np.divide(apart, level, out=np.zeros_like(level), where=lit), nan=np.inf)
    y, x = np.unravel_index(int(errors.argmax()), errors.shape)
    return float(errors[y, x]), (int(x), int(y)), int(lit.sum())
