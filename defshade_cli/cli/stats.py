"""The record that `--stats` writes: what was asked, what it cost, what was decided and what came out."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from defshade_cli import __version__
from defshade_cli.image.appearing import write_text
from defshade_cli.settings import RenderJob

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from defshade_cli.rendering import FrameResult, ImageResult


class Stats:
    """Gathers the frames of one job; a context manager that writes the record also when the job fails.

    It is written before the job as well, so that a file that cannot be written costs no render: OutputError.
    """

    def __init__(self, job: RenderJob, path: Path | None) -> None:
        self._path = path
        self._record: dict[str, Any] = {"version": __version__, "job": job, "frames": []}

    def __enter__(self) -> Self:
        self._write()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._write()

    def add(self, result: FrameResult) -> None:
        """Keep a frame's figures; its pixels are not kept."""
        if self._path is not None:
            self._record["frames"].append(_frame_figures(result))

    def _write(self) -> None:
        if self._path is not None:
            write_record(self._path, self._record)


def write_record(path: Path, record: dict[str, Any]) -> None:
    """A file of JSON. Raises OutputError."""
    import json

    write_text(path, json.dumps(plain(record), indent=2, allow_nan=False) + "\n")


def plain(value: Any) -> Any:
    """`value` in JSON's terms: infinities and NaN are null, paths are text, dataclasses are objects."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, frozenset):
        return sorted(value)
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


def _frame_figures(result: FrameResult) -> dict[str, Any]:
    images = [_image_figures(image) for image in result.images]
    return {"frame": result.frame, "seconds": result.seconds, "images": images}


def _image_figures(image: ImageResult) -> dict[str, Any]:
    figures: dict[str, Any] = {"paths": image.paths, "skipped": image.skipped}
    film = image.film
    if film is None:
        return figures
    layers = {name: _layer_figures(pixels) for name, pixels in film.layers.items()}
    figures |= {"size": film.size, "camera": film.camera.path, "film": film.metadata, "layers": layers}
    return figures | {"decisions": image.plan.decisions if image.plan else ()}


def _layer_figures(pixels: NDArray[Any]) -> dict[str, Any]:
    """Least, greatest and mean of each channel over its finite values, and the share of finite values."""
    import numpy as np

    finite = np.isfinite(pixels)
    values = np.ma.masked_array(pixels, ~finite).reshape(-1, pixels.shape[-1])
    return {
        "min": values.min(axis=0).tolist(),
        "max": values.max(axis=0).tolist(),
        "mean": values.mean(axis=0, dtype=np.float64).tolist(),
        "finite": float(finite.mean()),
    }
