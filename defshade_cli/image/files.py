"""Film → files, and back.

    .exr     scene-linear, one scanline file with all layers; light and reflectance in half, data always in 32 bits
    others   a picture to look at (image.colour.picture), one file a layer: the beauty has the path itself,
             another layer puts its name before the suffix

A file appears whole or not at all: it is written beside its target under a hidden name, then renamed.
"""

from __future__ import annotations

import os
import re
import socket
import tempfile
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.errors import OutputError
from defshade_cli.image.colour import Pixels
from defshade_cli.image.encoders import EXR, encode, suffix_of
from defshade_cli.image.film import Film
from defshade_cli.image.layers import BEAUTY, in_order
from defshade_cli.image.metadata import read_provenance
from defshade_cli.settings import OutputSettings


def targets(layers: Iterable[str], output: OutputSettings, path: Path) -> dict[Path, tuple[str, ...]]:
    """The files that `write` makes for `path`, each with the layers in it. Raises UsageError for an unknown suffix."""
    names = in_order(layers)
    if not output.split_layers and (suffix_of(path) == EXR or len(names) == 1):
        return {path: names}
    beside = {name: path.with_name(f"{path.stem}.{name}{path.suffix}") for name in names}
    if not output.split_layers and BEAUTY in beside:
        beside[BEAUTY] = path
    return {file: (name,) for name, file in beside.items()}


def write(film: Film, output: OutputSettings, path: Path) -> tuple[Path, ...]:
    """Write the film at `path`, whose suffix picks the format; folders are made. Returns the files.

    Raises UsageError for a suffix, display or view that does not exist, OutputError for a file that cannot be
    written; what stood at its path then still stands.
    """
    files = targets(film.layers, output, path)
    for file, names in files.items():
        with _appearing_at(file) as hidden:
            encode(film, names, output, hidden)
    return tuple(files)


def check_writable(path: Path) -> None:
    """Raise now what `write` would raise after the render: UsageError for the suffix, OutputError for the place."""
    suffix_of(path)
    try:
        if path.is_dir():
            raise OutputError(f"{path}: is a folder")
        folder = next(parent for parent in path.absolute().parents if parent.exists())
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OutputError(f"{path}: {_reason(error)}") from error


def read(path: Path) -> dict[str, Pixels]:
    """Layer → (H, W, C) float32 of an image file, whoever wrote it; pictures stay display-encoded in [0, 1].

    Channels without a layer are the beauty, Z alone the depth; a further part of a multi-part EXR gives its name.
    A cropped data window is filled up with zeros. Raises OutputError.
    """
    layers: dict[str, Pixels] = {}
    for spec, pixels in _parts(path):
        for name, channels in _grouped(spec).items():
            layers.setdefault(name, np.take(pixels, channels, axis=-1))
    return layers


def read_header(path: Path) -> dict[str, Any]:
    """The provenance that `write` left in a file: scene, frame, samples and the film's metadata. Raises OutputError."""
    source = _open(path)
    return read_provenance((entry.name, entry.value) for entry in source.spec().extra_attribs)


def remove_abandoned(folder: Path) -> None:
    """Remove what writers that are dead left half written in a folder: those of this machine, whose processes we know.

    Raises OutputError.
    """
    name = re.compile(rf"{re.escape(_hidden_prefix())}(\d+)-[0-9a-f]+\.\w+")
    try:
        for path in folder.iterdir() if folder.is_dir() else ():
            if (match := name.fullmatch(path.name)) and not _is_alive(int(match[1])):
                path.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: {_reason(error)}") from error


def _hidden_prefix() -> str:
    return f".{socket.gethostname()}-"


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # somebody else's
        return True
    return True


@contextmanager
def _appearing_at(path: Path) -> Iterator[Path]:
    hidden = path.with_name(f"{_hidden_prefix()}{os.getpid()}-{threading.get_ident():x}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield hidden
            hidden.replace(path)
        finally:
            hidden.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{path}: {_reason(error)}") from error


def _reason(error: OSError) -> str:
    """One line: what the system says, or the first line of what the encoder says."""
    return error.strerror or str(error).strip().partition("\n")[0]


def _open(path: Path) -> oiio.ImageInput:
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), config)
    if source is None:
        raise OutputError(f"{path}: cannot be read: {oiio.geterror()}")
    return source


def _parts(path: Path) -> Iterator[tuple[oiio.ImageSpec, NDArray]]:
    source = _open(path)
    part = 0
    while source.seek_subimage(part, 0):
        spec = source.spec()
        pixels = source.read_image(part, 0, 0, spec.nchannels, oiio.FLOAT)
        if pixels is None:
            raise OutputError(f"{path}: cannot be read: {source.geterror()}")
        yield spec, _uncropped(spec, pixels)
        part += 1


def _uncropped(spec: oiio.ImageSpec, pixels: NDArray) -> NDArray:
    whole = (spec.full_height, spec.full_width)
    top, left = spec.y - spec.full_y, spec.x - spec.full_x
    if (top, left) == (0, 0) and pixels.shape[:2] == whole:
        return pixels
    canvas = np.zeros((*whole, pixels.shape[2]), pixels.dtype)
    rows, columns = slice(max(top, 0), top + spec.height), slice(max(left, 0), left + spec.width)
    inside = canvas[rows, columns]
    inside[...] = pixels[max(-top, 0) :, max(-left, 0) :][: inside.shape[0], : inside.shape[1]]
    return canvas


def _grouped(spec: oiio.ImageSpec) -> dict[str, list[int]]:
    """Layer → indices of its channels."""
    part = spec.get_string_attribute("oiio:subimagename")
    groups: dict[str, list[int]] = {}
    for index, channel in enumerate(spec.channelnames):
        layer = channel.rpartition(".")[0] or part or ("depth" if channel == "Z" else BEAUTY)
        groups.setdefault(layer, []).append(index)
    return groups
