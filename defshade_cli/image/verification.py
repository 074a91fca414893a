"""Does a file hold what was written? Read back before it takes its name."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from defshade_cli.errors import OutputError
from defshade_cli.image.colour import BRIGHTEST, Pixels
from defshade_cli.image.encoders import EXR, suffix_of
from defshade_cli.image.film import Film
from defshade_cli.image.layers import layer_in_file
from defshade_cli.image.reading import read
from defshade_cli.settings import OutputSettings


def verify(path: Path, film: Film, names: tuple[str, ...], output: OutputSettings) -> None:
    """Compare an EXR with the film, to the bit but for colours under a lossy compression; a picture by its size.

    Raises OutputError that names what differs, UsageError for a suffix of no known format.
    """
    layers = read(path, data_window=True)
    if suffix_of(path) != EXR:
        _check_shape(names[0], next(iter(layers.values())), film.size)
        return
    for name in names:
        found = layers.get(layer_in_file(film.row(name).exr_name))
        if found is None:
            raise OutputError(f"verified: layer {name} is missing from what was written")
        _check_shape(name, found, film.size)
        _check_values(name, found, film, output)


def _check_shape(name: str, pixels: Pixels, size: tuple[int, int]) -> None:
    if pixels.shape[1::-1] != size:
        found, wanted = ("x".join(map(str, shape)) for shape in (pixels.shape[1::-1], size))
        raise OutputError(f"verified: layer {name} reads back as {found}, not {wanted}")


def _check_values(name: str, found: Pixels, film: Film, output: OutputSettings) -> None:
    written = film.layers[name]
    is_color = film.row(name).is_color
    if is_color and output.compression == "dwaa":
        return
    if is_color and not output.full_float:
        written = np.clip(written, -BRIGHTEST, BRIGHTEST).astype(np.float16).astype(np.float32)
    differing = np.count_nonzero(~((found == written) | (np.isnan(found) & np.isnan(written))))
    if differing:
        raise OutputError(f"verified: {differing} values of layer {name} read back otherwise than they were written")
