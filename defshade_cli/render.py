"""The story of one job: stage → scene → plan → film → files, frame by frame."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from contextlib import ExitStack, closing, contextmanager, nullcontext
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from defshade_cli import __version__
from defshade_cli.errors import UsageError
from defshade_cli.farm.fingerprint import Fingerprint
from defshade_cli.farm.targets import FINGERPRINT, check_outputs, frame_files, frame_paths, is_done, remove_leftovers
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.files import write
from defshade_cli.image.film import Film
from defshade_cli.image.layers import resolve
from defshade_cli.image.layers.extras import extras_of
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import Plan, make_plan, plan_moments
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import Composition, RenderJob, RenderSettings
from defshade_cli.usd.reader import StageReader
from defshade_cli.usd.stage import open_stage


@dataclass(frozen=True, slots=True, eq=False)
class FrameResult:
    """What became of one frame.

    paths: the files written, or found where `skipped`.  film, plan: None where skipped.
    seconds: wall time per step: open (first frame only), read, plan, context, draw, write.
    """

    frame: float | None
    paths: tuple[Path, ...]
    skipped: bool = False
    film: Film | None = None
    plan: Plan | None = None
    seconds: dict[str, float] = field(default_factory=dict)


class Renderer:
    """The Pipelines of the devices that jobs name, each made when a frame first needs it; a context manager.

    One renderer serves one job after another. Closed, it can be used again.
    """

    def __init__(self) -> None:
        self._stack = ExitStack()
        self._pipelines: dict[int | None, Pipeline] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def pipeline(self, device: int | None) -> Pipeline:
        """Raises GpuError."""
        if device not in self._pipelines:
            self._pipelines[device] = Pipeline(self._stack.enter_context(Gpu(device)))
        return self._pipelines[device]

    def close(self) -> None:
        self._pipelines.clear()
        self._stack.close()


def run(job: RenderJob, *, command: str = "", renderer: Renderer | None = None) -> Generator[FrameResult, None, None]:
    """Render the job's frames in order, lazily. `command` goes into the files' headers.

    renderer: lent for the job; without it the job has its own.
    Raises the errors of errors.py; whatever was yielded before is complete on disk.
    """
    startup: dict[str, float] = {}
    with _timed(startup, "open"):
        reader = _reader(job)
    frames = job.frames or (reader.first_frame(),)
    check_outputs(job, frames, reader.camera_name)
    remove_leftovers(job, frames, reader.camera_name)
    provenance = {"version": __version__, "command": command, "stage": job.stage.name} | job.composition.choices
    fingerprint = Fingerprint(job)
    with nullcontext(renderer) if renderer else Renderer() as lent:
        for frame in frames:
            result = _render_frame(job, frame, reader, lent, provenance, fingerprint)
            yield replace(result, seconds=startup | result.seconds)
            startup = {}


def frames_of(job: RenderJob) -> tuple[float | None, ...]:
    """The frames that `run` renders. Raises StageError."""
    return job.frames or (_reader(job).first_frame(),)


def examine(job: RenderJob) -> tuple[Scene, Plan]:
    """Read and plan the first frame; render nothing. Raises StageError, UsageError."""
    reader = _reader(job)
    scene = reader.read(job.frames[0] if job.frames else reader.first_frame())
    return scene, make_plan(scene, job.settings)


def render(
    stage: str | Path,
    *,
    camera: str | None = None,
    frame: float | None = None,
    composition: Composition | None = None,
    **options: Any,
) -> Film:
    """Render one frame of a stage in memory.

    composition: variants, mask, session layers and payloads of the stage.
    options: fields of RenderSettings, e.g. size=(640, 360), samples=16, layers=("beauty", "depth").
    Raises UsageError for an unknown option, StageError, GpuError.
    """
    known = {f.name for f in fields(RenderSettings)}
    if unknown := sorted(options.keys() - known):
        raise UsageError(f"no render option named {', '.join(unknown)}; there are {', '.join(sorted(known))}")
    settings = RenderSettings(**options)
    settings = replace(settings, layers=resolve(settings.layers))
    frames = (frame,) if frame is not None else ()
    job = RenderJob(Path(stage), frames, camera, composition or Composition(), settings)
    with closing(run(job)) as results:
        result = next(results)
    assert result.film is not None
    return result.film


def _reader(job: RenderJob) -> StageReader:
    settings = job.settings
    return StageReader(
        open_stage(job.stage, job.composition, job.camera),
        camera=job.camera,
        purposes=settings.purposes,
        complexity=settings.complexity,
        size=settings.size,
        width=settings.width,
        extras=extras_of(settings.layers),
    )


def _render_frame(
    job: RenderJob,
    frame: float | None,
    reader: StageReader,
    renderer: Renderer,
    provenance: dict[str, Any],
    fingerprint: Fingerprint,
) -> FrameResult:
    files = frame_files(job, frame, reader.camera_name)
    made_of = fingerprint.of(frame) if files else ""
    if is_done(job, files, made_of):
        return FrameResult(frame, files, skipped=True)
    seconds: dict[str, float] = {}
    with _timed(seconds, "read"):
        scene = reader.read(frame)
    with _timed(seconds, "plan"):
        plan = make_plan(scene, job.settings)
    with _timed(seconds, "context"):
        pipeline = renderer.pipeline(job.device)
    with _timed(seconds, "draw"):
        moments = plan_moments(scene, plan, reader.read_shutter(scene, plan.moments), job.settings)
        film = pipeline.render(scene, plan, moments)
    with _timed(seconds, "write"):
        film = replace(
            film, metadata=provenance | film.metadata | _cost(plan, seconds["draw"]) | {FINGERPRINT: made_of}
        )
        paths = frame_paths(job, frame, reader.camera_name)
        written = tuple(file for path in paths for file in write(film, job.output, path))
    return FrameResult(frame, written, film=film, plan=plan, seconds=seconds)


def _cost(plan: Plan, seconds: float) -> dict[str, Any]:
    return {
        "layout": plan.layout,
        "shading": plan.shading,
        "seconds": round(seconds, 4),
    }


@contextmanager
def _timed(seconds: dict[str, float], step: str) -> Iterator[None]:
    start = time.perf_counter()
    yield
    seconds[step] = time.perf_counter() - start
