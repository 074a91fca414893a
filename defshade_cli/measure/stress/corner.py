"""A corner: one stage, and how it is seen."""

from __future__ import annotations

from dataclasses import field, replace

from defshade_cli.dataclass import dataclass
from defshade_cli.measure.stress.stage import StressStage
from defshade_cli.settings import RenderSettings

SEEN = RenderSettings(size=(48, 27), shadows=False, light_points=1)
"""A small image of one sample, in the far field and without shadows: what the reference knows."""
EXACT = replace(SEEN, light_tolerance=1e-60)
"""Without the tolerance by which lights are left out that add less than 1e-5."""


@dataclass(frozen=True, slots=True)
class Corner:
    """One stage and how it is seen.

    why: set where the error may pass the bound, and says why; the pixels must be finite all the same.
    """

    family: str
    name: str
    stage: StressStage = field(default_factory=StressStage)
    settings: RenderSettings = SEEN
    why: str = ""
