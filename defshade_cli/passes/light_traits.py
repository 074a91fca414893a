"""Traits of lights, which the shaders that sum lights have as literals.

What a trait makes dead, the compiler drops: a software rasteriser executes both sides of a branch, and fetches each
number of a record for each pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.buffers import LIGHT_BLOCK
from defshade_cli.gpu.records import block_source, literal
from defshade_cli.passes.light_records import NO_CONE, NO_IES

Traits = tuple[tuple[str, str], ...]
"""(field of the Light record, its GLSL literal) of each."""

_CHOOSING = ("profile", "shadow_count", "is_sky", "is_whole", "by_rays")
"""Fields of a few values, each with its own code."""

_UNUSED = {"extent": 0.0, "radius": 0.0, "focus": 0.0, "cone_angle": NO_CONE, "reach": np.inf}
"""Values with which a light has no use for some code."""


def traits_of(records: NDArray[Any]) -> list[Traits]:
    """Of each of (L,) Light records."""
    unused = [records[name] == np.float32(value) for name, value in _UNUSED.items()]
    codes = np.column_stack([*(records[name] for name in _CHOOSING), *unused, records["ies_table"] == NO_IES])
    _, first, kind = np.unique(codes, axis=0, return_index=True, return_inverse=True)
    kinds = [_traits(records[number], codes[number]) for number in first]
    return [kinds[number] for number in kind.ravel()]


def common_traits(records: NDArray[Any]) -> Traits:
    """Those that all of (L,) Light records have."""
    first, *others = map(set, dict.fromkeys(traits_of(records)))
    return tuple(sorted(first.intersection(*others)))


def _traits(record: np.void, codes: NDArray[np.uint32]) -> Traits:
    fields = [*_CHOOSING, *compress([*_UNUSED, "ies_table"], codes[len(_CHOOSING) :])]
    return tuple((name, literal(record[name])) for name in fields)


def lights_source(most: int, common: Traits) -> str:
    """GLSL: `Light light_of(uint index)` of a block of `most` lights that have traits in common."""
    return "\n".join(
        [
            block_source("Light", most, LIGHT_BLOCK),
            "Light light_of(uint index) {",
            "    Light light = light_at(index);",
            *_assignments(common),
            "    return light;",
            "}",
        ]
    )


def written_out_source(each: Sequence[Traits]) -> str:
    """GLSL: `add_lights`, one light of the block after the other, each by its traits.

    An index that is a constant lets a software rasteriser fetch a record once for all pixels.
    """
    body = []
    for number, traits in enumerate(each):
        added = "    add_light(total, light, surface, position, v);"
        body += [f"    light = light_at({number}u);", *_assignments(traits), added]
    arguments = "inout Lit total, Surface surface, vec3 position, vec3 v"
    block = block_source("Light", len(each), LIGHT_BLOCK)
    return "\n".join([block, f"void add_lights({arguments}) {{", "    Light light;", *body, "}"])


def _assignments(traits: Traits) -> list[str]:
    return [f"    light.{name} = {value};" for name, value in traits]
