"""The story of one job: stage → scene → plan → film → files, frame by frame."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager, nullcontext
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from defshade_cli import __version__
from defshade_cli.dataclass import dataclass
from defshade_cli.errors import DefshadeError, UnsoundImage, UsageError
from defshade_cli.farm.open_job import OpenJob
from defshade_cli.farm.shots import Shot
from defshade_cli.farm.targets import FINGERPRINT, check_outputs, is_done, remove_leftovers, shot_files, shot_paths
from defshade_cli.image.files import write
from defshade_cli.image.film import Film
from defshade_cli.image.layers import BEAUTY
from defshade_cli.plan import Plan, ShutterSample, make_plan, plan_after, plan_moments
from defshade_cli.rendering import tiles
from defshade_cli.rendering.pictures import shown
from defshade_cli.rendering.renderer import Renderer
from defshade_cli.rendering.results import FrameResult, ImageResult
from defshade_cli.rendering.soundness import sound
from defshade_cli.rendering.stills import Picture, Stills
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import Composition, OutputSettings, RenderJob, RenderSettings
from defshade_cli.usd.reader import StageReader

if TYPE_CHECKING:
    from concurrent.futures import Future

_FOR_FILES = ("check", "show", "write")
"""Steps that turn a film into files."""


@dataclass(frozen=True, slots=True, eq=False)
class _Drawn:
    """An image that is drawn and not yet written. fault: what is wrong with it, to be said once it is written."""

    shot: Shot
    film: Film
    plan: Plan
    seconds: dict[str, float]
    fault: str = ""

    def written(self) -> ImageResult:
        with _timed(self.seconds, "write"):
            files = (file for path in shot_paths(self.shot) for file in write(self.film, self.shot.job.output, path))
            paths = tuple(files)
        if self.fault:
            raise UnsoundImage(f"{paths[0] if paths else self.film.scene_name}: {self.fault}")
        return ImageResult(paths, film=self.film, plan=self.plan, seconds=self.seconds)


@dataclass(frozen=True, slots=True, eq=False)
class _DrawnFrame:
    frame: float | None
    images: tuple[_Drawn | ImageResult, ...]
    startup: dict[str, float]

    def written(self) -> FrameResult:
        images = tuple(image.written() if isinstance(image, _Drawn) else image for image in self.images)
        return FrameResult(self.frame, images, self.startup)


def run(job: RenderJob, *, command: str = "", renderer: Renderer | None = None) -> Generator[FrameResult, None, None]:
    """Render the job's frames in order, lazily. `command` goes into the files' headers.

    renderer: lent for the job; without it the job has its own.
    A frame is written while the next one is drawn. Raises the errors of errors.py; whatever was yielded before is
    complete on disk.
    """
    startup: dict[str, float] = {}
    with _timed(startup, "open"):
        opened = OpenJob(job)
    shots = {frame: opened.shots(frame) for frame in opened.frames}
    everything = [shot for those in shots.values() for shot in those]
    check_outputs(everything)
    remove_leftovers(everything)
    written = _written_behind if len(shots) > 1 else _written_at_once
    with nullcontext(renderer) if renderer else Renderer(lone=len(everything) == 1) as lent:
        yield from written(_drawn_frames(opened, shots, lent, command, startup))


def examine(job: RenderJob) -> tuple[Scene, Plan]:
    """Read and plan the first image of the first frame; render nothing. Raises StageError, UsageError."""
    opened = OpenJob(job)
    shot = opened.shots(opened.frames[0])[0]
    scene = opened.reader(shot.product).read(shot.frame)
    return scene, make_plan(scene, shot.job.settings)


def time_steps(job: RenderJob) -> dict[str, float]:
    """Wall time of each step of the first frame: open, read, plan, context, upload, draw. Nothing is written.

    Raises the errors of errors.py.
    """
    with closing(run(replace(job, frames=job.frames[:1], output=OutputSettings()))) as results:
        seconds = next(results).seconds
    return {step: taken for step, taken in seconds.items() if step not in _FOR_FILES}


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
    job = RenderJob(
        Path(stage),
        frames,
        camera,
        composition=composition or Composition(),
        settings=settings,
        given=frozenset(options),
    )
    with closing(run(job)) as results:
        result = next(results)
    film = result.images[0].film
    assert film is not None
    return film


def _drawn_frames(
    opened: OpenJob, shots: dict[float | None, list[Shot]], renderer: Renderer, command: str, startup: dict[str, float]
) -> Iterator[_DrawnFrame]:
    stills = Stills()
    for frame in opened.frames:
        images = tuple(_draw(shot, opened, renderer, command, stills) for shot in shots[frame])
        yield _DrawnFrame(frame, images, startup)
        startup = {}


def _written_at_once(frames: Iterator[_DrawnFrame]) -> Generator[FrameResult, None, None]:
    for frame in frames:
        yield frame.written()


def _written_behind(frames: Iterator[_DrawnFrame]) -> Generator[FrameResult, None, None]:
    """Each frame once it is written, which happens while the next is drawn; also if drawing that one fails."""
    from concurrent.futures import ThreadPoolExecutor

    waiting: Future[FrameResult] | None = None
    failure: DefshadeError | None = None
    try:
        with ThreadPoolExecutor(1, "writer") as writer:
            while failure is None:
                try:
                    drawn = next(frames, None)
                except DefshadeError as error:
                    drawn, failure = None, error
                if waiting:
                    yield waiting.result()
                if drawn is None:
                    break
                waiting = writer.submit(drawn.written)
        if failure:
            raise failure
    finally:
        waiting = failure = None  # an error that the frame of its own traceback holds would keep the stage open


def _draw(shot: Shot, opened: OpenJob, renderer: Renderer, command: str, stills: Stills) -> _Drawn | ImageResult:
    job, files = shot.job, shot_files(shot)
    made_of = opened.fingerprint(shot) if files else ""
    if is_done(job, files, made_of):
        return ImageResult(files, skipped=True)
    seconds: dict[str, float] = {}
    reader = opened.reader(shot.product)
    with _timed(seconds, "read"):
        scene = reader.read(shot.frame)
    picture = stills.find(shot, scene)
    if picture is None:
        picture = _picture(shot, scene, reader, renderer, seconds, stills.last(shot))
        stills.keep(shot, scene, picture)
    film, plan = replace(picture.film, frame=shot.frame), picture.plan
    facts = _provenance(shot, scene, command) | film.metadata | _cost(plan, seconds.get("draw", 0.0))
    if not picture.fault:
        facts |= {FINGERPRINT: made_of}
    fault = picture.fault if job.output.on_nan == "error" else ""
    return _Drawn(shot, replace(film, metadata=facts), plan, seconds, fault)


def _picture(
    shot: Shot,
    scene: Scene,
    reader: StageReader,
    renderer: Renderer,
    seconds: dict[str, float],
    last: tuple[Scene, Picture] | None,
) -> Picture:
    """last: scene and picture of the frame before."""
    job = shot.job
    with _timed(seconds, "plan"):
        plan = make_plan(scene, job.settings)
        if last:
            plan = plan_after(last[0], last[1].plan, scene, plan)
    with _timed(seconds, "context"):
        pipeline = renderer.pipeline(job.device)
    with _timed(seconds, "upload"):
        uploaded = pipeline.upload(scene, plan)
    with _timed(seconds, "draw"):
        moments = partial(_moments, scene, plan, reader, job.settings)
        film = tiles.render(pipeline, scene, plan, moments, uploaded, last[1].drawn if last else None)
    with _timed(seconds, "check"):
        checked = sound(film, scene, job.settings, pipeline, job.output.on_nan)
    with _timed(seconds, "show"):
        return Picture(shown(checked.film, shot, renderer), film, plan, checked.fault)


def _moments(scene: Scene, plan: Plan, reader: StageReader, settings: RenderSettings) -> Iterator[ShutterSample]:
    return plan_moments(plan, reader.read_shutter(scene, plan.moments), settings)


def _provenance(shot: Shot, scene: Scene, command: str) -> dict[str, Any]:
    facts = {"version": __version__, "command": command, "stage": shot.job.stage.name, "lights": scene.lit_by}
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
