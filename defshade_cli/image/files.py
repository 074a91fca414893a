"""Film → files.

    .exr     scene-linear, one scanline file with all layers; light and reflectance in half, data always in 32 bits
    others   a picture to look at (image.colour.picture), one file a layer: the beauty has the path itself,
             another layer puts its name before the suffix; as a sheet all are tiles of one

A file appears whole or not at all: image/appearing.py.
"""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

from defshade_cli.errors import OutputError
from defshade_cli.image.appearing import appearing_at, hidden_prefix
from defshade_cli.image.encoders import EXR, PICTURES, encode, suffix_of
from defshade_cli.image.film import Film
from defshade_cli.image.layers import BEAUTY, LAYERS, in_order
from defshade_cli.settings import OutputSettings


def targets(layers: Iterable[str], output: OutputSettings, path: Path) -> dict[Path, tuple[str, ...]]:
    """The files that `write` makes for `path`, each with the layers in it. Raises UsageError for an unknown suffix."""
    names, main = in_order(layers), BEAUTY
    if output.variables:
        names = tuple(v.name for v in output.variables)
        main = next((v.name for v in output.variables if v.layer == BEAUTY), names[0])
    if not output.split_layers and (output.sheet or suffix_of(path) == EXR or len(names) == 1):
        return {path: names}
    labels = {name: name if output.variables else LAYERS[name].exr_name for name in names}
    beside = {name: path.with_name(f"{path.stem}.{label}{path.suffix}") for name, label in labels.items()}
    if not output.split_layers and main in beside:
        beside[main] = path
    return {file: (name,) for name, file in beside.items()}


def pictures(layers: Iterable[str], output: OutputSettings, path: Path) -> set[tuple[str, bool]]:
    """(layer, with alpha) of every colour that `write` puts through the display transform for `path`.

    Raises UsageError for an unknown suffix.
    """
    suffix = suffix_of(path)
    if suffix == EXR:
        return set()
    sources = {v.name: v.layer for v in output.variables}
    names = (sources.get(name, name) for shown in targets(layers, output, path).values() for name in shown)
    return {(name, PICTURES[suffix].alpha) for name in names if LAYERS[name].is_color}


def write(film: Film, output: OutputSettings, path: Path) -> tuple[Path, ...]:
    """Write the film at `path`, whose suffix picks the format; folders are made. Returns the files.

    Raises UsageError for a suffix, display or view that does not exist, OutputError for a file that cannot be
    written or does not read back as it was written; what stood at its path then still stands.
    """
    files = targets(film.layers, output, path)
    film = film.under(output.variables)
    for file, names in files.items():
        with _appearing_at(file) as hidden:
            encode(film, names, output, hidden)
            if output.verify and not (output.sheet and suffix_of(path) != EXR):
                from defshade_cli.image.verification import verify

                verify(hidden, film, names, output)
    return tuple(files)


def check_writable(path: Path) -> None:
    """Raise now what `write` would raise after the render: OutputError for a place that takes no file."""
    try:
        if path.is_dir():
            raise OutputError(f"{path}: is a folder")
        folder = next(parent for parent in path.absolute().parents if parent.exists())
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OutputError(f"cannot write {path}: {_reason(error)}") from error


def remove_abandoned(folder: Path) -> None:
    """Remove what writers that are dead left half written in a folder: those of this machine, whose processes we know.

    Raises OutputError.
    """
    prefix = hidden_prefix()
    name = re.compile(rf"{re.escape(prefix)}(\d+)-[0-9a-f]+\.\w+")
    try:
        with os.scandir(folder) if folder.is_dir() else nullcontext(()) as entries:
            hidden = [entry.name for entry in entries if entry.name.startswith(prefix)]
        for file in hidden:
            if (match := name.fullmatch(file)) and not _is_alive(int(match[1])):
                (folder / file).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: {_reason(error)}") from error


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
    try:
        with appearing_at(path) as hidden:
            yield hidden
    except OSError as error:
        raise OutputError(f"cannot write {path}: {_reason(error)}") from error


def _reason(error: OSError) -> str:
    """One line: what the system says, or the first line of what the encoder says."""
    return error.strerror or str(error).strip().partition("\n")[0]
