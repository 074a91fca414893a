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
from defshade_cli.farm.open_job import OpenJob
from defshade_cli.farm.shots import Shot
from defshade_cli.farm.targets import FINGERPRINT, check_outputs, is_done, remove_leftovers, shot_files, shot_paths
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.files import write
from defshade_cli.image.film import Film
from defshade_cli.image.layers import BEAUTY
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import Plan, make_plan, plan_moments
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import Composition, RenderJob, RenderSettings


@dataclass(frozen=True, slots=True, eq=False)
class ImageResult:
    """What became of one image.

    paths: the files written, or found where `skipped`.  film, plan: None where skipped.
    seconds: wall time per step: read, plan, context, draw, write.
    """

    paths: tuple[Path, ...]
    skipped: bool = False
    film: Film | None = None
    plan: Plan | None = None
    seconds: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class FrameResult:
    """What became of one frame: an image for each product of the stage's, or one.

    startup: wall time per step before the first frame: open.
    """

    frame: float | None
    images: tuple[ImageResult, ...]
    startup: dict[str, float] = field(default_factory=dict)

    @property
    def paths(self) -> tuple[Path, ...]:
        return tuple(path for image in self.images for path in image.paths)

    @property
    def skipped(self) -> bool:
        return all(image.skipped for image in self.images)

    @property
    def seconds(self) -> dict[str, float]:
        """Wall time per step, of all images together."""
        steps = dict.fromkeys(step for image in self.images for step in image.seconds)
        return self.startup | {step: sum(image.seconds.get(step, 0.0) for image in self.images) for step in steps}


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
        opened = OpenJob(job)
    shots = {frame: opened.shots(frame) for frame in opened.frames}
    everything = [shot for those in shots.values() for shot in those]
    check_outputs(everything)
    remove_leftovers(everything)
    with nullcontext(renderer) if renderer else Renderer() as lent:
        for frame in opened.frames:
            images = tuple(_render_image(shot, opened, lent, command) for shot in shots[frame])
            yield FrameResult(frame, images, startup)
            startup = {}


def examine(job: RenderJob) -> tuple[Scene, Plan]:
    """Read and plan the first image of the first frame; render nothing. Raises StageError, UsageError."""
    opened = OpenJob(job)
    shot = opened.shots(opened.frames[0])[0]
    scene = opened.reader(shot.product).read(shot.frame)
    return scene, make_plan(scene, shot.job.settings)


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
    settings = RenderSettings(**{"layers": (BEAUTY,), **options})
    frames = (frame,) if frame is not None else ()
    job = RenderJob(Path(stage), frames, camera, composition=composition or Composition(), settings=settings)
    with closing(run(job)) as results:
        result = next(results)
    film = result.images[0].film
    assert film is not None
    return film


def _render_image(shot: Shot, opened: OpenJob, renderer: Renderer, command: str) -> ImageResult:
    job, files = shot.job, shot_files(shot)
    made_of = opened.fingerprint(shot) if files else ""
    if is_done(job, files, made_of):
        return ImageResult(files, skipped=True)
    seconds: dict[str, float] = {}
    reader = opened.reader(shot.product)
    with _timed(seconds, "read"):
        scene = reader.read(shot.frame)
    with _timed(seconds, "plan"):
        plan = make_plan(scene, job.settings)
    with _timed(seconds, "context"):
        pipeline = renderer.pipeline(job.device)
    with _timed(seconds, "draw"):
        moments = plan_moments(scene, plan, reader.read_shutter(scene, plan.moments), job.settings)
        film = pipeline.render(scene, plan, moments)
    with _timed(seconds, "write"):
        facts = _provenance(shot, command) | film.metadata | _cost(plan, seconds["draw"]) | {FINGERPRINT: made_of}
        film = replace(film, metadata=facts)
        written = tuple(file for path in shot_paths(shot) for file in write(film, job.output, path))
    return ImageResult(written, film=film, plan=plan, seconds=seconds)


def _provenance(shot: Shot, command: str) -> dict[str, Any]:
    facts = {"version": __version__, "command": command, "stage": shot.job.stage.name}
    product = {"product": shot.product.path} if shot.product.path else {}
    return facts | product | shot.job.composition.choices


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
