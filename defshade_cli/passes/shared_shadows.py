"""Shadows of a dome's directions, of which each pixel looks up some and has the others from its neighbours.

Pixels are of a few classes in turn, by a lattice in which all are within two pixels of any other. Those of one class
look up the maps of some directions; what they find is as it is on the surface beside them: edges of shadows are off by
two pixels at most, and no direction weighs more than one of many.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import groupby, product
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.buffers import SHADOW_BLOCK, RecordBuffer
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import read_source
from defshade_cli.gpu.shaders import set_uniforms
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.lighting import LightingVariant
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.shadow_atlas import ShadowAtlas, shadow_source
from defshade_cli.plan import Plan, PlannedLight
from defshade_cli.plan.shared_shadows import SHARED_DIRECTIONS, may_share

_STEPS = 4
"""Neighbours of each class that a pixel chooses among."""

_FARTHEST = 6
"""Pixels, across or down, to find those among."""


@dataclass(frozen=True, slots=True, eq=False)
class SharedRun:
    """What one class of pixels, the number-th, sees of a run of directions; seen: of these pixels, side by side."""

    number: int
    seen: moderngl.Texture

    def bind(self, program: moderngl.Program) -> moderngl.Texture:
        """Let `program` find the class; returns what it saw."""
        set_uniforms(program, {"shared_class": self.number})
        return self.seen


class SharedShadows:
    """Looks up a run of directions at a time; the next overwrites what the last has found."""

    def __init__(self, gpu: Gpu, frame: Frame) -> None:
        self._context, self._frame, self._screen = gpu.context, frame, Screen(gpu)
        self._records = RecordBuffer(gpu, SHADOW_BLOCK, uniform=True)
        self._array = cache(lambda variant, classes: self._screen.array(_compile(gpu, variant, classes)))

    def see(self, variant: LightingVariant, plan: Plan, gbuffer: GBuffer, maps: ShadowAtlas, turn: int) -> SharedRun:
        """What a class of pixels sees of at most SHARED_DIRECTIONS lights, each of which has a single map.

        turn: of the classes, one after another.
        """
        classes = plan.sharing_pixels
        array, number = self._array(variant, classes), turn % classes
        width, height = plan.size
        target = self._frame.of_tiles("shared", 2, (-(-width // classes), height), "u4")
        target.framebuffer.use()
        self._context.enable_only(moderngl.NOTHING)
        self._records.write(np.roll(maps.records, -int(maps.first_record[0])))
        set_uniforms(array.program, {"shared_class": number})
        gbuffer.bind(array.program, shadow_atlas=maps.depth)
        self._screen.draw(array)
        return SharedRun(number, target.textures["shared"])


def shared_runs(lights: Sequence[PlannedLight], plan: Plan) -> list[slice]:
    """Of a batch's lights, those whose shadows pixels share, as many at a time as they have bits for."""
    if plan.sharing_pixels == 1:
        return []
    runs, first = [], 0
    for planned, alike in groupby(lights, key=lambda planned: planned):
        end = first + len(list(alike))
        starts = range(first, end, SHARED_DIRECTIONS) if may_share(planned) else ()
        runs += [slice(start, min(start + SHARED_DIRECTIONS, end)) for start in starts]
        first = end
    return runs


def apart_from(count: int, runs: Sequence[slice]) -> NDArray[np.intp]:
    """(N,) numbers of those of `count` lights that no run has."""
    apart = np.ones(count, bool)
    for run in runs:
        apart[run] = False
    return np.flatnonzero(apart)


def sharing_source(classes: int) -> dict[str, str]:
    """What lib/shared_shadows.glsl includes: from a pixel to those of each class that are nearest."""
    reach = range(-_FARTHEST, _FARTHEST + 1)
    steps = sorted(product(reach, reach), key=lambda step: (step[0] ** 2 + step[1] ** 2, step))
    of_class = [[step for step in steps if (step[0] + 3 * step[1]) % classes == k][:_STEPS] for k in range(classes)]
    listed = ", ".join(f"ivec2({x}, {y})" for near in of_class for x, y in near)
    constants = f"const int SHARED_CLASSES = {classes}, SHARED_STEPS = {_STEPS};\n"
    count = classes * _STEPS
    text = f"{constants}const ivec2 steps_to_class[{count}] = ivec2[{count}]({listed});\n"
    return {"generated/shared_shadows.glsl": text}


def _look_ups_source() -> str:
    """GLSL: `uvec2 look_up_shared(vec3 position, vec3 triangle)`, with every map's number written out."""
    body: list[Any] = []
    for number in range(SHARED_DIRECTIONS):
        word, shift = "xy"[number // 8], 4 * (number % 8)
        body += [f"    light.first_shadow_map = {number}u;"]
        body += [f"    seen.{word} |= uint(15.0 * visibility(light, position, triangle) + 0.5) << {shift}u;"]
    head = ["uvec2 look_up_shared(vec3 position, vec3 triangle) {", "    uvec2 seen = uvec2(0u);", "    Light light;"]
    return "\n".join([*head, "    light.shadow_count = 1u;", *body, "    return seen;", "}"])


def _compile(gpu: Gpu, variant: LightingVariant, classes: int) -> moderngl.Program:
    generated = {"generated/planes.glsl": read_source(variant.planes, variant.layout), **sharing_source(classes)}
    generated |= {**shadow_source(("map",)), "generated/shared_maps.glsl": _look_ups_source()}
    defines = [plane.define for plane in variant.planes] + ["ORTHOGRAPHIC"] * variant.orthographic
    defines += ["SHADOWS", "SHADOW_MAPS", "VOLUME_QUAD"]
    return gpu.shaders.program("screen.vert", "shared_shadows.frag", defines=defines, generated=generated)
