"""How many moments of the shutter the samples of a frame see, and how they share them."""

from __future__ import annotations

import math

from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings

MOST_MOMENTS = 32
"""Times of the shutter at which a frame is read."""

_SAMPLES_A_ROUND = 256
"""Samples after which the moments come round again."""


def count_moments(scene: Scene, settings: RenderSettings) -> int:
    """One a sample, up to MOST_MOMENTS; 0 where nothing moves or nobody asks. A single sample sees the frame."""
    samples = min(settings.most_samples, _SAMPLES_A_ROUND)
    if samples == 1 or not scene.moves or not settings.motion_blur:
        return 0
    return math.ceil(samples / math.ceil(samples / MOST_MOMENTS))


def share_moments(samples: int, moments: int, *, may_stop: bool) -> int:
    """How many samples in a row see the same moment: just one where the render may stop before it has seen all."""
    return 1 if may_stop else math.ceil(min(samples, _SAMPLES_A_ROUND) / moments)
