"""The files of a job's frames: which they are, whether they can be written, and whether a frame is done already."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from defshade_cli.errors import OutputError, UsageError
from defshade_cli.farm.names import expand, has_frame_token
from defshade_cli.image.colour import resolve_view
from defshade_cli.image.encoders import EXR, suffix_of
from defshade_cli.image.files import check_writable, targets
from defshade_cli.settings import RenderJob

Frames = Sequence[float | None]


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
    if any(suffix_of(file) != EXR for file in files):
        resolve_view(job.output.display, job.output.view)
    for folder_file in {file.parent: file for file in files}.values():
        check_writable(folder_file)


def is_done(job: RenderJob, files: Sequence[Path]) -> bool:
    """May the frame of `files` be skipped? Raises OutputError where one exists and must not."""
    existing = [file for file in files if file.exists()]
    if existing and job.output.existing == "error":
        raise OutputError(f"{existing[0]} exists, and --existing error was asked")
    return bool(files) and job.output.existing == "skip" and len(existing) == len(files)
