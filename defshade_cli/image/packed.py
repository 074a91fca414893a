"""Image files as libraries open them: those inside a package lie on disk for a while."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePath

from defshade_cli.scene.texture import ImageFile


@contextmanager
def on_disk(file: ImageFile) -> Iterator[str]:
    """A path that OpenImageIO opens."""
    if file.contents is None:
        yield file.path
        return
    suffix = PurePath(file.path.rstrip("]")).suffix
    with tempfile.NamedTemporaryFile(suffix=suffix) as copy:
        copy.write(file.contents)
        copy.flush()
        yield copy.name


def stamp(file: ImageFile) -> int:
    """Another where the file is another, 0 where there is none."""
    if file.contents is not None:
        return hash(file.contents)
    path = Path(file.path)
    return path.stat().st_mtime_ns if path.exists() else 0
