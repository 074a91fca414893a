"""Tiles in which no light of some lights arrives: those lights are left out of the tiles' lists.

A tile may lie behind what a light sees: its box is a rectangle in the light's map, and farther from the light than all
that surfaces there go on to. The maps are read in blocks, of each of which the farthest is kept. Or all of its surfaces
may be turned away.
"""

from __future__ import annotations

from functools import cache

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import Plane, read_source
from defshade_cli.gpu.shaders import set_textures, set_uniforms
from defshade_cli.gpu.targets import Target
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_lists import TILE, tile_grid
from defshade_cli.passes.light_traits import Traits, lights_source
from defshade_cli.passes.lighting import LightingVariant
from defshade_cli.passes.screen import WHOLE, Screen
from defshade_cli.passes.shadow_atlas import ShadowAtlas, shadow_source
from defshade_cli.plan import Plan
from defshade_cli.plan.shadow_maps import ATLAS
from defshade_cli.settings import Layout

_BLOCK = 4
"""Texels a side, a divisor of a map's."""

_BITS = 32
"""Lights at a time."""

_WORTHWHILE = 0.25
"""Lights of all pixels, for each texel of their maps: for fewer it takes longer to look than to light."""


class HiddenLights:
    """Of one batch of lights after another."""

    def __init__(self, gpu: Gpu, frame: Frame, most: int) -> None:
        self._context, self._frame, self._screen = gpu.context, frame, Screen(gpu)
        defines = ["SHADOWS", "SHADOW_CUBES", f"SHADOW_BLOCK {_BLOCK}"]
        sources = shadow_source(("cube",))
        self._blocks = cache(
            lambda: self._screen.array(
                gpu.shaders.program("screen.vert", "least_depths.frag", defines=defines, generated=sources)
            )
        )
        self._array = cache(lambda variant, common: self._screen.array(_compile(gpu, variant, common, most)))
        self._tile_bounds = cache(lambda *kind: self._screen.array(_bounds_program(gpu, *kind)))

    def begin(self, gbuffer: GBuffer, plan: Plan) -> None:
        """With what a sample shows, whose View is bound."""
        self._gbuffer, self._tiles = gbuffer, tile_grid(plan.size)
        self._bounds = cache(lambda: self._find_bounds(plan))

    def see(self, atlas: ShadowAtlas) -> None:
        """What look-ups in its maps compare with."""
        side, array = ATLAS // _BLOCK, self._blocks()
        self._least = self._frame.of_tiles("least", 1, (side, side))
        self._least.framebuffer.use()
        set_textures(array.program, {"shadow_atlas": atlas.depth})
        self._draw(array, np.array([[0.0, 0.0, 1.0, atlas.rows_used / ATLAS]], np.float32))

    def find(self, variant: LightingVariant, common: Traits, count: int, atlas: ShadowAtlas) -> NDArray[np.bool_]:
        """(rows, columns, L): does nothing of a light arrive in a tile? Of those in the block, which are `count`."""
        array, bounds = self._array(variant, common), self._bounds().textures
        target = self._frame.of_tiles("hidden", 1, self._tiles, "u4")
        target.framebuffer.use()
        maps = atlas.bind(array.program)
        set_textures(array.program, {**bounds, "shadow_atlas": maps, "least_depths": self._least.textures["least"]})
        found = []
        for first in range(0, count, _BITS):
            end = min(first + _BITS, count)
            set_uniforms(array.program, {"first_light": first, "end_light": end})
            self._draw(array, WHOLE)
            found.append(target.read("hidden") >> np.arange(end - first, dtype=np.uint32) & 1)
        return np.concatenate(found, axis=2) > 0

    def _find_bounds(self, plan: Plan) -> Target:
        """Of what the tiles show."""
        target = self._frame.of_tiles("low high low_normal high_normal", 4, self._tiles)
        target.framebuffer.use()
        array = self._tile_bounds(self._gbuffer.planes, plan.layout, plan.camera.projection == "orthographic")
        self._gbuffer.bind(array.program)
        self._draw(array, WHOLE)
        return target

    def _draw(self, array: moderngl.VertexArray, regions: NDArray[np.float32]) -> None:
        self._context.enable_only(moderngl.NOTHING)
        self._screen.cover(regions)
        self._screen.draw(array)


def are_worth_finding(plan: Plan, atlas: ShadowAtlas, lights: int) -> bool:
    """Do so many lights cost more than to look for those that are hidden? Not where a layer counts those too."""
    pixels = plan.size[0] * plan.size[1]
    is_plain = not (plan.outputs or plan.shadow_styles)
    return is_plain and pixels * lights > _WORTHWHILE * atlas.texels_used


def _compile(gpu: Gpu, variant: LightingVariant, common: Traits, most: int) -> moderngl.Program:
    generated = {**shadow_source(variant.shadows), "generated/lights.glsl": lights_source(most, common)}
    defines = [*variant.shadow_defines, *variant.distances, f"SHADOW_BLOCK {_BLOCK}"]
    return gpu.shaders.program("screen.vert", "hidden_lights.frag", defines=defines, generated=generated)


def _bounds_program(gpu: Gpu, planes: tuple[Plane, ...], layout: Layout, orthographic: bool) -> moderngl.Program:
    generated = {"generated/planes.glsl": read_source(planes, layout)}
    defines = [plane.define for plane in planes] + [f"LIGHT_TILE {TILE}"] + ["ORTHOGRAPHIC"] * orthographic
    return gpu.shaders.program("screen.vert", "tile_bounds.frag", defines=defines, generated=generated)
