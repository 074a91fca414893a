"""When a render has samples enough, and where."""

from __future__ import annotations

import math
import time
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.image.film import Sampling, StopReason
from defshade_cli.passes.accumulation import AccumulationPass
from defshade_cli.passes.convergence import FEWEST, TILE, Convergence
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.screen import Narrowing, Screen
from defshade_cli.plan import Plan

if TYPE_CHECKING:
    from defshade_cli.passes.batch_means import BatchMeansPass


class Stopping:
    """Asked after each sample; narrows passes to the tiles that need more, and ends where none does."""

    def __init__(self, gpu: Gpu, frame: Frame, screen: Screen, narrowing: Narrowing) -> None:
        self._gpu, self._frame, self._screen, self._narrowing = gpu, frame, screen, narrowing

    @cached_property
    def _batches(self) -> BatchMeansPass:
        from defshade_cli.passes.batch_means import BatchMeansPass

        return BatchMeansPass(self._gpu, self._frame, self._screen)

    def begin(self, plan: Plan) -> None:
        """Start a frame: its clock, and its error as unknown."""
        self._plan, self._start = plan, time.perf_counter()
        self._convergence = Convergence(plan.size, plan.max_error)
        self._variance = np.broadcast_to(np.float32(np.inf), (plan.size[1], plan.size[0], 1))
        self._stopped_by: StopReason = "samples"
        if plan.tracks_error:
            self._batches.begin(plan.size)

    def is_over(self, accumulation: AccumulationPass) -> bool:
        """Was that the last sample? Not by their number: `samples` ends by itself."""
        if self._plan.tracks_error:
            self._batches.note(accumulation)
            if self._plan.max_error is not None and self._batches.are_complete and accumulation.count >= FEWEST:
                self._judge(accumulation.count)
                self._narrowing.to(self._convergence.active, TILE, self._plan.size)
        if self._convergence.has_arrived:
            self._stopped_by = "max-error"
        elif self._is_late():
            self._stopped_by = "time-limit"
        return self._stopped_by != "samples"

    def finish(self, samples: int) -> tuple[Sampling, NDArray[np.int32], NDArray[np.float32]]:
        """What came of it, samples of each pixel, and the variance of its mean luminance, (height, width, 1) each."""
        if self._plan.tracks_error:
            self._judge(samples)
            self._narrowing.end()
        else:
            self._convergence.samples[:] = samples
        counts = self._convergence.sample_count()
        error = self._convergence.estimate
        known = error if math.isfinite(error) else None
        least, most = int(self._convergence.samples.min()), int(self._convergence.samples.max())
        mean = float(counts.mean()) if least < most else float(most)
        sampling = Sampling(least, mean, most, known, self._stopped_by)
        return sampling, counts, self._variance

    def _judge(self, samples: int) -> None:
        luminance, self._variance = self._batches.read()
        self._convergence.judge(luminance, self._variance, samples)

    def _is_late(self) -> bool:
        if self._plan.time_limit is None:
            return False
        self._gpu.context.finish()
        return time.perf_counter() - self._start >= self._plan.time_limit
