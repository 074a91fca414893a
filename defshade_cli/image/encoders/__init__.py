"""The formats of image files, and what each holds of a film."""

from __future__ import annotations

from pathlib import Path

from defshade_cli.errors import UsageError
from defshade_cli.image.encoders.pictures import PICTURES, bits_of, write_picture, write_sheet
from defshade_cli.image.film import Film
from defshade_cli.settings import OutputSettings

__all__ = ["EXR", "PICTURES", "SUFFIXES", "check_format", "encode", "is_in_bytes", "suffix_of"]

EXR = ".exr"
SUFFIXES = (EXR, *PICTURES)


def suffix_of(path: Path) -> str:
    """The suffix in lower case. Raises UsageError for one that no encoder has."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        lacking = f"no format has the suffix '{suffix}'" if suffix else "a file's name ends with its format"
        raise UsageError(f"'{path}': {lacking}; write {', '.join(SUFFIXES)}")
    return suffix


def check_format(path: Path, output: OutputSettings) -> None:
    """Raises UsageError for a suffix that no encoder has, and for bits a channel that the format lacks."""
    suffix = suffix_of(path)
    if suffix != EXR and output.bits and output.bits not in PICTURES[suffix].bits:
        depths = " or ".join(map(str, PICTURES[suffix].bits))
        raise UsageError(f"'{path}': the format has {depths} bits a channel, not {output.bits}")


def is_in_bytes(path: Path, output: OutputSettings) -> bool:
    """Are colours that `path` shows, as EXR does not, stored in 8 bits a channel just as they are?

    Raises UsageError for a suffix of no known format.
    """
    if suffix_of(path) == EXR:
        return True
    return bits_of(path, output) == 8 and not (output.dither or output.sheet)


def encode(film: Film, names: tuple[str, ...], output: OutputSettings, path: Path) -> None:
    """Write layers to `path`: all as EXR or a sheet, the only one as a picture.

    Raises OSError with the reason, UsageError for a suffix, display or view that does not exist.
    """
    if suffix_of(path) == EXR:
        from defshade_cli.image.encoders.exr import write_exr

        write_exr(film, names, output, path)
    elif output.sheet:
        write_sheet(film, names, output, path)
    else:
        (name,) = names
        write_picture(film, name, output, path)
