"""Every combination of a Sweep drawn of one stage, in alternating rounds, against the converged picture."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import field, replace
from itertools import product
from pathlib import Path

from defshade_cli.dataclass import dataclass
from defshade_cli.farm.open_job import OpenJob
from defshade_cli.image.compare import Comparison, compare
from defshade_cli.image.film import Film
from defshade_cli.image.layers import BEAUTY
from defshade_cli.measure.bench.converged import Converged, converged, from_file
from defshade_cli.measure.bench.trial import Choice, Trial
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan, plan_moments
from defshade_cli.settings import LAYOUTS, Filter, Layout, RenderJob

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Sweep:
    """What is varied, and how it is measured.

    rounds: timed draws of each combination, alternating; their median counts.
    reference: file to count errors against; None for a float render of `reference_samples` with shadows and the
        filter in question.
    flip: measure FLIP too, seconds a megapixel.
    """

    layouts: tuple[Layout, ...] = LAYOUTS
    samples: tuple[int, ...] = (1, 4, 16, 64)
    shadows: tuple[bool, ...] = (True, False)
    filters: tuple[Filter, ...] = ("box",)
    rounds: int = 3
    reference: Path | None = None
    reference_samples: int = 1024
    flip: bool = True

    @property
    def choices(self) -> tuple[Choice, ...]:
        """All combinations."""
        return tuple(Choice(*values) for values in product(self.layouts, self.samples, self.shadows, self.filters))


@dataclass(frozen=True, slots=True)
class Bench:
    """What a sweep of one stage found. size: (width, height) in pixels.  device: that drew it.

    references: the files that errors are counted against.
    """

    stage: Path
    size: tuple[int, int]
    device: str
    references: tuple[Path, ...]
    trials: tuple[Trial, ...]


def run_sweep(pipeline: Pipeline, device: str, job: RenderJob, sweep: Sweep, say: Say) -> Bench:
    """Draw the first image of the job's first frame with every combination. say: told what is at work.

    Raises the errors of errors.py; UsageError where `sweep.reference` is of another size.
    """
    artist = _Artist(pipeline, job)
    choices = sweep.choices if artist.casts_shadows else replace(sweep, shadows=(True,)).choices
    references = {name: _reference(artist, sweep, name, say) for name in sweep.filters}
    errors = {}
    for choice in choices:
        say(f"{job.stage.name}: {choice}")
        film = artist.draw(choice)
        errors[choice] = compare(film.layers[BEAUTY][..., :3], references[choice.filter].pixels, flip=sweep.flip)[0]
    times = _Times()
    for number in range(sweep.rounds):
        say(f"{job.stage.name}: round {number + 1} of {sweep.rounds}")
        for choice in choices:
            times.measure(choice, artist.draw)
    trials = tuple(times.trial(choice, errors[choice]) for choice in choices)
    paths = tuple(dict.fromkeys(each.path for each in references.values() if each.path))
    return Bench(job.stage, artist.size, device, paths, trials)


class _Artist:
    """Draws one image of a job with other settings. The stage is read once: what a sweep varies is not of it."""

    def __init__(self, pipeline: Pipeline, job: RenderJob) -> None:
        opened = OpenJob(replace(job, settings=replace(job.settings, layers=(BEAUTY,))))
        self._pipeline, self.frame = pipeline, opened.frames[0]
        shot = opened.shots(self.frame)[0]
        self.job, self._reader = shot.job, opened.reader(shot.product)
        self._scene = self._reader.read(self.frame)
        plan = make_plan(self._scene, self.job.settings)
        self.size, self.casts_shadows = plan.size, plan.shadows

    def draw(self, choice: Choice) -> Film:
        settings = choice.applied(self.job.settings)
        plan = make_plan(self._scene, settings)
        uploaded = self._pipeline.upload(self._scene, plan)
        moments = plan_moments(plan, self._reader.read_shutter(self._scene, plan.moments), settings)
        return self._pipeline.render(self._scene, plan, moments, uploaded)


def _reference(artist: _Artist, sweep: Sweep, name: Filter, say: Say) -> Converged:
    if sweep.reference is not None:
        return from_file(sweep.reference)
    best = Choice("float", sweep.reference_samples, True, name)

    def draw() -> Film:
        say(f"{artist.job.stage.name}: converged, {best}")
        return artist.draw(best)

    return converged(replace(artist.job, settings=best.applied(artist.job.settings)), artist.frame, draw)


@dataclass(frozen=True, slots=True)
class _Times:
    """Seconds of each draw. wall, cpu: by choice, one a round."""

    wall: dict[Choice, list[float]] = field(default_factory=dict)
    cpu: dict[Choice, list[float]] = field(default_factory=dict)

    def measure(self, choice: Choice, draw: Callable[[Choice], object]) -> None:
        wall, cpu = time.perf_counter(), time.process_time()
        draw(choice)
        self.wall.setdefault(choice, []).append(time.perf_counter() - wall)
        self.cpu.setdefault(choice, []).append(time.process_time() - cpu)

    def trial(self, choice: Choice, error: Comparison) -> Trial:
        wall, cpu = (statistics.median(seconds[choice]) for seconds in (self.wall, self.cpu))
        return Trial(choice, wall, cpu, error.rel_mse, error.flip)
