"""The picture that a sweep's errors are counted against: a float render of many samples, kept by what it is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import OutputError
from defshade_cli.farm.fingerprint import Fingerprint
from defshade_cli.image.files import write
from defshade_cli.image.film import Film
from defshade_cli.image.layers import BEAUTY
from defshade_cli.image.reading import read
from defshade_cli.resources import cache_folder
from defshade_cli.settings import OutputSettings, RenderJob


@dataclass(frozen=True, slots=True, eq=False)
class Converged:
    """pixels: (H, W, 3) scene-linear radiance.  path: the file it was read from or is kept in, if any."""

    pixels: NDArray[Any]
    path: Path | None


def converged(job: RenderJob, frame: float | None, draw: Callable[[], Film]) -> Converged:
    """The picture of `job`, drawn by `draw` where it is not kept yet.

    It is kept under the fingerprint of stage and settings, so that whatever changes pixels draws it anew.
    Raises OutputError where it cannot be kept, and what `draw` raises; UsageError as write.
    """
    made_of = Fingerprint(replace(job, output=_OUTPUT)).of(frame)
    path = cache_folder("converged") / f"{job.stage.stem}.{made_of}.exr" if made_of else None
    if path is not None and path.exists():
        return from_file(path)
    film = draw()
    if path is not None:
        write(film, _OUTPUT, path)
    return Converged(film.layers[BEAUTY][..., :3], path)


def from_file(path: Path) -> Converged:
    """Raises OutputError for a file that cannot be read or that holds no beauty."""
    layers = read(path)
    if BEAUTY not in layers:
        raise OutputError(f"{path}: no beauty to count errors against, only {', '.join(layers)}")
    return Converged(layers[BEAUTY][..., :3], path)


_OUTPUT = OutputSettings(full_float=True)
