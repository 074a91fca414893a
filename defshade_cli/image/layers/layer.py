"""What one output layer is."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Literal, get_args

from defshade_cli.dataclass import dataclass

SampledSource = Literal["lighting", "coverage", "matte"]
"""Sources that are summed over samples; any other is a plane of the data GBuffer."""

_UNSAFE = re.compile(r"\W+", re.ASCII)

BEAUTY = "beauty"
MAIN_PART = "rgba"
"""The part of a multi-part EXR that holds the beauty, as Nuke names it."""

SCENE_LINEAR, SCENE_UNITS, UNIT_VECTOR, ID = "scene-linear", "scene units", "unit vector", "id"
AS_STORED = "as stored"
"""The unit of what another program wrote and nothing tells of."""

MOST_RANKS = 16
"""Of a Cryptomatte."""

MATTE_CHANNELS = tuple(f"{group:02d}.{channel}" for group in range(MOST_RANKS // 2) for channel in "RGBA")
"""(id, coverage) of rank after rank, two ranks a group."""


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
        """As in EXR: `R` for the beauty, which readers look for without a layer, `normal.X` for the others.

        Mattes are `CryptoObject00.R`, as Cryptomatte's specification has them.
        """
        if self.name == BEAUTY:
            return self.channels
        separator = "" if self.source == "matte" else "."
        return tuple(f"{self.exr_name}{separator}{channel}" for channel in self.channels)

    @property
    def suffixes(self) -> set[str]:
        """The last part of its channels' names, by which readers and compressions know them."""
        return {channel.rpartition(".")[2] for channel in self.channels}

    @property
    def exr_name(self) -> str:
        """What stands before the channels: letters, digits and _ alone, as compositors ask."""
        name = _UNSAFE.sub("_", self.name).strip("_")
        return name[0].upper() + name[1:] if self.source == "matte" else name

    def of_width(self, width: int) -> Layer:
        """The same with `width` channels: its first ones, or of a matte as many as there are ranks."""
        channels = MATTE_CHANNELS if self.source == "matte" else self.channels
        return replace(self, channels=channels[:width])
