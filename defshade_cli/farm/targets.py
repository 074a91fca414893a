"""The files of a job's frames: which they are, whether they can be written, and whether a frame is done already."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from defshade_cli.errors import OutputError, UsageError
from defshade_cli.farm.names import expand, has_frame_token
from defshade_cli.farm.shots import Shot
from defshade_cli.image.colour import display_transform
from defshade_cli.image.encoders import EXR, check_format, suffix_of
from defshade_cli.image.files import check_writable, remove_abandoned, targets
from defshade_cli.image.render_space import RenderSpace
from defshade_cli.settings import RenderJob

FINGERPRINT = "fingerprint"
"""The name of farm.fingerprint's text in a file's header, among the provenance."""


def shot_paths(shot: Shot) -> tuple[Path, ...]:
    """The job's patterns with the frame, and the names of stage, camera and product filled in. Raises UsageError."""
    names = {"scene": shot.job.stage.stem, "camera": shot.camera, "product": shot.product.name}
    return tuple(expand(pattern, frame=shot.frame, **names) for pattern in shot.job.output.patterns)


def shot_files(shot: Shot) -> tuple[Path, ...]:
    """Every file that a shot becomes, layers apart included. Raises UsageError."""
    layers = shot.job.settings.layers or ()
    return tuple(file for path in shot_paths(shot) for file in targets(layers, shot.job.output, path))


def check_outputs(shots: Sequence[Shot]) -> list[Path]:
    """Say before the first of a job's shots what would go wrong after it. Returns the files that they become.

    Raises UsageError for names that collide, unknown suffixes, displays and views; OutputError for folders that
    cannot be written.
    """
    frames = len({shot.frame for shot in shots})
    jobs = {shot.product: shot.job for shot in shots}
    for pattern in {pattern for job in jobs.values() for pattern in job.output.patterns}:
        if frames > 1 and not has_frame_token(pattern):
            raise UsageError(f"{frames} frames would overwrite each other in {pattern}; put #### in its name")
    files = [file for shot in shots for file in shot_files(shot)]
    if len(set(files)) < len(files):
        twice = next(file for file in files if files.count(file) > 1)
        raise UsageError(f"two outputs would be written to {twice}")
    for job in jobs.values():
        _check_formats(list({suffix_of(file): file for file in files}.values()), job)
    for folder_file in {file.parent: file for file in files}.values():
        check_writable(folder_file)
    return files


def _check_formats(files: Sequence[Path], job: RenderJob) -> None:
    """files: one of each suffix."""
    for file in files:
        check_format(file, job.output)
    chosen = (job.output.display, job.output.view, job.output.look)
    if any(chosen) or any(suffix_of(file) != EXR for file in files):
        display_transform(*chosen, RenderSpace(config=job.settings.ocio))


def remove_leftovers(shots: Sequence[Shot]) -> None:
    """Clear the folders of the shots' files of what killed renders left half written.

    Raises OutputError, and UsageError for a suffix of no known format.
    """
    for folder in {file.parent for shot in shots for file in shot_files(shot)}:
        remove_abandoned(folder)


def is_done(job: RenderJob, files: Sequence[Path], fingerprint: str) -> bool:
    """May the frame of `files` be skipped? Only where every file says that it was made of the same.

    Raises OutputError where a file exists and must not.
    """
    existing = [file for file in files if file.exists()]
    if existing and job.output.existing == "error":
        raise OutputError(f"{existing[0]} exists, and --existing error was asked")
    if job.output.existing != "skip" or not fingerprint or len(existing) < len(files):
        return False
    return all(_fingerprint_in(file) == fingerprint for file in files)


def _fingerprint_in(file: Path) -> str | None:
    """What the header says; None where it says nothing, or cannot be read, for then the file is not a finished one."""
    from defshade_cli.image.reading import read_header

    try:
        return read_header(file).get(FINGERPRINT)
    except OutputError:
        return None
