"""The lighting of lights that reach most of the image: every light at every pixel.

What the GBuffer says of a pixel is read once for some lights, which the shader has one by one, each by its traits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.buffers import LIGHT_BLOCK, RecordBuffer
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import background_depth
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.passes.light_traits import Traits, traits_of, written_out_source
from defshade_cli.passes.lighting import LightingVariant
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.shadow_atlas import ShadowAtlas, kind_of
from defshade_cli.passes.shared_shadows import SharedRun, sharing_source
from defshade_cli.passes.tables import NO_TABLES, LightTables
from defshade_cli.plan import Plan, PlannedLight
from defshade_cli.plan.cost import LIGHTS_A_DRAW
from defshade_cli.plan.shared_shadows import SHARED_DIRECTIONS


class WholeLighting:
    """A few lights a draw, of all that the screen shows; each set of traits is compiled once."""

    def __init__(self, gpu: Gpu, screen: Screen) -> None:
        self._context, self._screen = gpu.context, screen
        self._block = RecordBuffer(gpu, LIGHT_BLOCK, uniform=True)
        self._array = cache(lambda *kind: screen.array(_compile(gpu, *kind)))

    def add(
        self,
        lights: Sequence[PlannedLight],
        records: NDArray[Any],
        plan: Plan,
        gbuffer: GBuffer,
        targets: LightTargets,
        shadows: ShadowAtlas | None = None,
        tables: LightTables = NO_TABLES,
        shared: SharedRun | None = None,
    ) -> None:
        """All `lights`, records (L,), on top of the targets. shared: what pixels know of their shadows, in one draw."""
        self._context.enable_only(moderngl.BLEND | moderngl.DEPTH_TEST)
        self._context.blend_func = moderngl.ONE, moderngl.ONE
        self._context.depth_func = "!="
        maps = shadows.count if shadows else np.zeros(len(lights), int)
        for members, each in _draws(lights, records, SHARED_DIRECTIONS if shared else LIGHTS_A_DRAW):
            kinds = tuple(sorted({kind for count in set(maps[members].tolist()) for kind in kind_of(count)}))
            variant = LightingVariant.of(plan, [lights[number] for number in members], kinds)
            if shared:
                variant, each = replace(variant, shared=True), _numbered(each, members)
            array = self._array(variant, each, plan.sharing_pixels if shared else 1)
            targets.of(lights[members[0]].groups).use()
            atlas = shadows.bind(array.program) if shadows else None
            seen = shared.bind(array.program) if shared else None
            gbuffer.bind(array.program, shadow_atlas=atlas, ies_tables=tables.candela, shared_shadows=seen)
            array.program["screen_depth"] = background_depth(gbuffer.layout)
            self._block.write(records[members])
            self._screen.draw(array)


def _draws(
    lights: Sequence[PlannedLight], records: NDArray[Any], most: int
) -> Iterator[tuple[list[int], tuple[Traits, ...]]]:
    """The numbers of the lights of each draw, and their traits: of the same groups, alike ones side by side."""
    traits = traits_of(records)
    order = sorted(range(len(traits)), key=traits.__getitem__)
    for groups in dict.fromkeys(planned.groups for planned in lights):
        members = [number for number in order if lights[number].groups == groups]
        for first in range(0, len(members), most):
            chosen = members[first : first + most]
            yield chosen, tuple(traits[number] for number in chosen)


def _numbered(each: tuple[Traits, ...], members: Sequence[int]) -> tuple[Traits, ...]:
    """With the numbers by which pixels know of shadows."""
    return tuple((*traits, ("first_shadow_map", f"{number}u")) for traits, number in zip(each, members, strict=True))


def _compile(gpu: Gpu, variant: LightingVariant, each: tuple[Traits, ...], sharing: int) -> moderngl.Program:
    generated = {**variant.generated, "generated/lights.glsl": written_out_source(each), **sharing_source(sharing)}
    defines = [*variant.defines, *variant.distances]
    return gpu.shaders.program("screen.vert", "lighting_whole.frag", defines=defines, generated=generated)
