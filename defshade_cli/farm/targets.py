"""The files of a job's frames: which they are, whether they can be written, and whether a frame is done already."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from defshade_cli.errors import OutputError, UsageError
from defshade_cli.farm.names import expand, has_frame_token
from defshade_cli.image.colour import display_transform
from defshade_cli.image.encoders import EXR, check_format, suffix_of
from defshade_cli.image.files import check_writable, remove_abandoned, targets
from defshade_cli.image.reading import read_header
from defshade_cli.image.render_space import RenderSpace
from defshade_cli.settings import RenderJob

Frames = Sequence[float | None]

FINGERPRINT = "fingerprint"
"""The name of farm.fingerprint's text in a file's header, among the provenance."""


def frame_paths(job: RenderJob, frame: float | None, camera: str) -> tuple[Path, ...]:
    """The job's patterns with the frame, the stage's and the camera's name filled in. Raises UsageError."""
    return tuple(expand(p, frame=frame, scene=job.stage.stem, camera=camera) for p in job.output.patterns)


def frame_files(job: RenderJob, frame: float | None, camera: str) -> tuple[Path, ...]:
    """Every file that one frame becomes, layers apart included. Raises UsageError."""
    paths = frame_paths(job, frame, camera)
    return tuple(file for path in paths for file in targets(job.settings.layers, job.output, path))


def check_outputs(job: RenderJob, frames: Frames, camera: str) -> None:
    """Say before the first frame what would go wrong after it.

    Raises UsageError for names that collide, unknown suffixes, displays and views; OutputError for folders that
    cannot be written.
    """
    for pattern in job.output.patterns:
        if len(frames) > 1 and not has_frame_token(pattern):
            raise UsageError(f"{len(frames)} frames would overwrite each other in {pattern}; put #### in its name")
    files = [file for frame in frames for file in frame_files(job, frame, camera)]
    if len(set(files)) < len(files):
        twice = next(file for file in files if files.count(file) > 1)
        raise UsageError(f"two outputs would be written to {twice}")
    for file in files:
        check_format(file, job.output)
    if any(suffix_of(file) != EXR for file in files):
        space = RenderSpace(config=job.settings.ocio)
        display_transform(job.output.display, job.output.view, job.output.look, space)
    for folder_file in {file.parent: file for file in files}.values():
        check_writable(folder_file)


def remove_leftovers(job: RenderJob, frames: Frames, camera: str) -> None:
    """Clear the folders of the job's files of what killed renders left half written. Raises OutputError."""
    for folder in {file.parent for frame in frames for file in frame_files(job, frame, camera)}:
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
    try:
        return read_header(file).get(FINGERPRINT)
    except OutputError:
        return None
