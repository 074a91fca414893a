"""What is handed to a worker, and what comes back: chunks of frames of one stage, and the outcome of each frame."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import field, replace
from pathlib import Path

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import BatchError, UsageError
from defshade_cli.farm.shots import Shot, make_shot
from defshade_cli.farm.targets import check_outputs, remove_leftovers
from defshade_cli.scene.product import Product
from defshade_cli.settings import RenderJob

LARGEST_CHUNK = 16
_CHUNKS_PER_WORKER = 4


@dataclass(frozen=True, slots=True)
class Chunk:
    """Frames of one stage that one worker renders one after another: those of `job`.

    attempt: 1 at first; one more after each failure.
    """

    job: RenderJob
    attempt: int = 1

    def split(self) -> list[Chunk]:
        """A chunk for each frame. A job without frames, which renders its stage's first, is one frame."""
        return [replace(self, job=replace(self.job, frames=(frame,))) for frame in self.job.frames] or [self]

    def again(self) -> Chunk:
        """The same chunk, for another attempt."""
        return replace(self, attempt=self.attempt + 1)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one frame, whose `task` is a chunk of that frame alone.

    frame: time code; None for the default time, and where a stage's first frame is not known for an error.
    seconds: wall time per step.  error: one sentence where the frame failed, else empty.
    exit_code: what its error would end `render` with.
    log: what the worker wrote to its stdout and stderr meanwhile.
    """

    task: Chunk
    frame: float | None
    paths: tuple[Path, ...] = ()
    skipped: bool = False
    seconds: dict[str, float] = field(default_factory=dict)
    error: str = ""
    exit_code: int = 0
    log: str = ""

    @property
    def stage(self) -> Path:
        """The file that the frame is of."""
        return self.task.job.stage


def failed(task: Chunk, error: str, exit_code: int = BatchError.exit_code) -> Outcome:
    """The outcome of a frame that came to nothing; without an exit code of its own, that of a worker that is lost."""
    return Outcome(task, next(iter(task.job.frames), None), error=error, exit_code=exit_code)


def joined(tasks: Sequence[Chunk]) -> Chunk:
    """One chunk of single frames of the same job."""
    frames = tuple(frame for task in tasks for frame in task.job.frames)
    return replace(tasks[0], job=replace(tasks[0].job, frames=frames))


def frame_count(jobs: Iterable[RenderJob]) -> int:
    """How many frames some jobs have; a job without a range has one."""
    return sum(max(1, len(job.frames)) for job in jobs)


def make_chunks(jobs: Sequence[RenderJob], size: int) -> list[Chunk]:
    """The frames of each job in chunks of at most `size`, in order."""
    return [Chunk(part) for job in jobs for part in _parts(job, size)]


def chunk_size(frames: int, workers: int) -> int:
    """Small enough that every worker gets several chunks, large enough that stages are not opened for each frame."""
    return min(LARGEST_CHUNK, max(1, frames // (workers * _CHUNKS_PER_WORKER)))


def check_batch(jobs: Sequence[RenderJob]) -> None:
    """Say before the first frame what would go wrong after it: check_outputs, and jobs that share a file.

    Raises UsageError, OutputError.
    """
    writers: dict[Path, RenderJob] = {}
    for job in jobs:
        for file in check_outputs(_expected_shots(job)):
            other = writers.setdefault(file, job)
            if other is not job:
                raise UsageError(f"{other.stage} and {job.stage} would both be written to {file}; put {{scene}} in -o")


@contextmanager
def leaving_no_leftovers(jobs: Sequence[RenderJob]) -> Iterator[None]:
    """Clear the folders of the jobs' files, at the end, of what workers that died left half written."""
    try:
        yield
    finally:
        remove_leftovers([shot for job in jobs for shot in _expected_shots(job)])


def _expected_shots(job: RenderJob) -> list[Shot]:
    """The shots of a stage that is not open yet: its first frame, its cameras and its products are its own to know."""
    first, *others = job.frames or (0.0,)
    shot = make_shot(job, first, Product(), job.camera or "camera")
    return [shot, *(replace(shot, frame=frame) for frame in others)]


def _parts(job: RenderJob, size: int) -> Iterator[RenderJob]:
    if not job.frames:
        yield job
    for start in range(0, len(job.frames), size):
        yield replace(job, frames=job.frames[start : start + size])
