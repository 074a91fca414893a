"""Link sets of lights as bits that shaders/lib/linking.glsl reads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.light import Light

ALL_LINKED = 0xFFFFFFFF
"""The place of a light that leaves nothing out."""


@dataclass(frozen=True, slots=True, eq=False)
class LinkBits:
    """words: uint32, a run of sets a row.  lights, casts: place of a light's first word; ALL_LINKED where none."""

    words: NDArray[np.uint32] = field(default_factory=lambda: np.zeros(1, np.uint32))
    lights: Mapping[Light, int] = field(default_factory=dict)
    casts: Mapping[Light, int] = field(default_factory=dict)


NOTHING_LINKED = LinkBits()


def link_bits(lights: Iterable[Light]) -> LinkBits:
    """The rows of those lights that leave something out."""
    rows: list[NDArray[np.uint32]] = [np.zeros(1, np.uint32)]
    lit: dict[Light, int] = {}
    casting: dict[Light, int] = {}
    for light in lights:
        if light.links:
            for places, row in ((lit, light.links.lights), (casting, light.links.casts)):
                places[light] = ALL_LINKED if row.all() else sum(map(len, rows))
                rows.append(_packed(row) if not row.all() else rows[0][:0])
    return LinkBits(np.concatenate(rows), lit, casting)


def _packed(row: NDArray[np.bool_]) -> NDArray[np.uint32]:
    padded = np.zeros(-(-len(row) // 32) * 32, bool)
    padded[: len(row)] = row
    return np.packbits(padded, bitorder="little").view("<u4").astype(np.uint32)
