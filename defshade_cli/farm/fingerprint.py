"""What a frame was made of, as a short text that its file's header keeps: equal texts, equal pictures.

It covers the contents of every layer, texture and other asset that the stage depends on, their names as seen from the
stage, the camera and all settings that reach the file, the frame and the version of defshade. It leaves out where the
stage and the output lie and the device, so a copied folder or another host finds its frames finished. Contents and not
dates are compared, for copying and version control change dates; a file is read once a process as long as its size and
date stay.
"""

from __future__ import annotations

import hashlib
import logging
from dataclasses import replace
from functools import cache, cached_property
from pathlib import Path

from defshade_cli import __version__
from defshade_cli.errors import StageError
from defshade_cli.settings import RenderJob
from defshade_cli.usd.opening.dependencies import read_dependencies

log = logging.getLogger("defshade")

_BYTES = 16


class Fingerprint:
    """The fingerprints of a job's frames. The stage is read once, when the first is asked for."""

    def __init__(self, job: RenderJob) -> None:
        self._job = job

    def of(self, frame: float | None) -> str:
        """32 hexadecimal digits; nothing where it cannot be known what the stage depends on."""
        if self._base is None:
            return ""
        return hashlib.blake2b(f"{self._base} {frame!r}".encode(), digest_size=_BYTES).hexdigest()

    @cached_property
    def _base(self) -> str | None:
        """What all frames have in common."""
        layers = self._job.composition.session_layers
        try:
            contents = [_made_of(file) for file in (self._job.stage, *layers)]
        except (StageError, OSError) as error:
            log.info("its frames will never count as finished: %s", error)
            return None
        output = replace(self._job.output, patterns=(), fallback="", existing="overwrite")
        composition = replace(self._job.composition, session_layers=tuple(Path(layer.name) for layer in layers))
        stage = Path(self._job.stage.name)
        job = replace(self._job, stage=stage, composition=composition, frames=(), device=None, output=output)
        given = sorted(job.given)  # a set has another order in each process
        return repr((__version__, contents, replace(job, given=frozenset()), given))


def _made_of(file: Path) -> tuple[list[tuple[str, str]], tuple[str, ...]]:
    """Names and contents of all that a stage or layer depends on, and what of it is missing."""
    needed = read_dependencies(file)
    return sorted((name, _contents(path)) for name, path in needed.files.items()), needed.missing


def _contents(path: Path) -> str:
    status = path.stat()
    return _digest(path, status.st_size, status.st_mtime_ns)


@cache
def _digest(path: Path, _size: int, _changed: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()  # processors have it built in
