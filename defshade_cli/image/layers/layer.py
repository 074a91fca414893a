"""What one output layer is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

SampledSource = Literal["lighting", "coverage"]
"""Sources that are summed over samples; any other is a plane of the data GBuffer."""

BEAUTY = "beauty"
MAIN_PART = "rgba"
"""The part of a multi-part EXR that holds the beauty, as Nuke names it."""

SCENE_LINEAR, SCENE_UNITS, UNIT_VECTOR = "scene-linear", "scene units", "unit vector"


@dataclass(frozen=True, slots=True)
class Layer:
    """One output layer.

    channels: EXR channel suffixes.  unit, space: as written to the metadata.
    source: where the passes find it: a SampledSource, or a plane of gpu/planes.py, of which it takes the components
        from `first` on.
    background: the value of a pixel that nothing covers.
    filtered: averaged over samples; data layers are one sample at the pixel's centre, because an averaged
        depth makes flying points and an averaged normal shrinks.
    """

    name: str
    channels: tuple[str, ...]
    unit: str
    space: str
    source: str
    background: float
    filtered: bool
    summary: str
    first: int = 0

    @property
    def is_color(self) -> bool:
        """Light or reflectance that a display transform can show; the rest is data, kept in 32 bits."""
        return self.unit == SCENE_LINEAR

    @property
    def is_sampled(self) -> bool:
        """Is it made of the beauty's samples, rather than of a plane?"""
        return self.source in get_args(SampledSource)

    @property
    def channel_names(self) -> tuple[str, ...]:
        """As in EXR: `R` for the beauty, which readers look for without a layer, `normal.X` for the others."""
        return self.channels if self.name == BEAUTY else tuple(f"{self.name}.{c}" for c in self.channels)

    def of_width(self, width: int) -> Layer:
        """The same with its first `width` channels."""
        return replace(self, channels=self.channels[:width])
