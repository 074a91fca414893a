"""The lighting of many lights: the image in tiles, each with a list of the lights that may reach it.

A pixel is shaded once for all of a draw's lights: what the GBuffer says of it is read once, and nothing but their sum
is blended. The tiles' depths come from the GBuffer, the lists from light_lists.py. Lights are in a uniform block,
whose elements a software rasteriser fetches faster than those of a storage buffer.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.buffers import LIGHT_BLOCK, LIGHT_LISTS, RecordBuffer
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.records import record
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.hidden_lights import HiddenLights, are_worth_finding
from defshade_cli.passes.light_lists import TILE, LightLists, list_lights
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.passes.light_traits import Traits, common_traits, lights_source
from defshade_cli.passes.lighting import LightingVariant
from defshade_cli.passes.sampling import Sample
from defshade_cli.passes.screen import Drawn, Screen, regions_of
from defshade_cli.passes.shadow_atlas import ShadowAtlas, kind_of
from defshade_cli.passes.tables import NO_TABLES, LightTables
from defshade_cli.passes.tile_depths import TileDepths, boxes_at
from defshade_cli.passes.view import placement
from defshade_cli.plan import Plan, PlannedLight
from defshade_cli.plan.bounds import LightBounds
from defshade_cli.spaces import inverse_rigid

_MOST_LIGHTS = 256
"""A draw."""

_NOTHING = np.array([1.0, -1.0])
"""Nearest and farthest depth of a tile that shows nothing."""


class LightTiles:
    """The tiles of one image; the lights in as few draws as one program and one block allow."""

    def __init__(self, gpu: Gpu, frame: Frame) -> None:
        self._context, self._frame = gpu.context, frame
        self._most = min(_MOST_LIGHTS, gpu.max_uniform_bytes // record("Light").itemsize)
        self._block = RecordBuffer(gpu, LIGHT_BLOCK, uniform=True)
        self._lists = RecordBuffer(gpu, LIGHT_LISTS)
        self._depths = TileDepths(gpu, frame)
        self._screen, self._hidden = Screen(gpu), HiddenLights(gpu, frame, self._most)
        self._array = cache(lambda variant, common: self._screen.array(_compile(gpu, variant, common, self._most)))

    def begin(self, gbuffer: GBuffer, plan: Plan, sample: Sample, drawn: Drawn | None = None) -> None:
        """What the tiles show, by the GBuffer of a sample; of those that are drawn."""
        self._plan, depths = plan, self._depths.read(gbuffer, plan)
        self._runs = self._frame.tile_runs(depths.shape[1::-1])
        if drawn:
            depths = np.where(_are_drawn(drawn, depths.shape[:2])[..., None], depths, _NOTHING)
        self._boxes = boxes_at(depths, plan, sample)
        self._hidden.begin(gbuffer, plan)
        self._camera_from_relative = inverse_rigid(placement(plan.camera, sample))

    def add(
        self,
        lights: Sequence[PlannedLight],
        records: NDArray[Any],
        gbuffer: GBuffer,
        targets: LightTargets,
        shadows: ShadowAtlas | None = None,
        tables: LightTables = NO_TABLES,
    ) -> None:
        """All `lights`, records (L,), on top of the targets; those that cost more, for shape or shadows, apart."""
        hiding = shadows if shadows and are_worth_finding(self._plan, shadows, len(lights)) else None
        if hiding:
            self._hidden.see(hiding)
        maps = shadows.count.tolist() if shadows else [0] * len(lights)
        kinds = [
            (planned.groups, planned.light.shaping is not None, kind_of(count))
            for planned, count in zip(lights, maps, strict=True)
        ]
        for kind in dict.fromkeys(kinds):
            members = np.array([number for number, other in enumerate(kinds) if other == kind])
            variant = LightingVariant.of(self._plan, [lights[number] for number in members], kind[2])
            common = common_traits(records[members])
            array = self._array(variant, common)
            for first in range(0, len(members), self._most):
                chosen = records[members[first : first + self._most]]
                self._write(chosen)
                hidden = self._hidden.find(variant, common, len(chosen), hiding) if hiding and kind[2] else None
                lists = list_lights(light_bounds(chosen, self._camera_from_relative), self._boxes, hidden)
                targets.of(kind[0]).use()
                atlas = shadows.bind(array.program) if shadows else None
                gbuffer.bind(array.program, tile_runs=self._runs, shadow_atlas=atlas, ies_tables=tables.candela)
                self._draw(array, lists)

    def _write(self, records: NDArray[Any]) -> None:
        """The lights' block."""
        block = np.zeros(self._most, records.dtype)
        block[: len(records)] = records
        self._block.write(block)

    def _draw(self, array: moderngl.VertexArray, lists: LightLists) -> None:
        if not len(lists.lights):
            return
        self._context.enable_only(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE
        self._lists.write(lists.lights)
        self._runs.write(lists.runs)
        self._screen.cover(regions_of(lists.runs[..., 1] > 0, TILE, self._plan.size))
        self._screen.draw(array)


def _compile(gpu: Gpu, variant: LightingVariant, common: Traits, most: int) -> moderngl.Program:
    generated = {**variant.generated, "generated/lights.glsl": lights_source(most, common)}
    defines = [*variant.defines, *variant.distances, f"LIGHT_TILE {TILE}"]
    return gpu.shaders.program("screen.vert", "lighting_tiles.frag", defines=defines, generated=generated)


def _are_drawn(drawn: Drawn, grid: tuple[int, ...]) -> NDArray[np.bool_]:
    """(rows, columns) of tiles, by some as large or smaller ones."""
    times, parts = TILE // drawn.side, drawn.tiles
    padded = np.zeros((grid[0] * times, grid[1] * times), bool)
    padded[: parts.shape[0], : parts.shape[1]] = parts
    return np.asarray(padded.reshape(grid[0], times, grid[1], times).any(axis=(1, 3)))


def light_bounds(records: NDArray[Any], camera_from_relative: NDArray[np.float64]) -> LightBounds:
    """Of Light records (L,). camera_from_relative: (4, 4)."""
    rotation, offset = camera_from_relative[:3, :3], camera_from_relative[:3, 3]
    return LightBounds(
        centre=records["position"].astype(np.float64) @ rotation.T + offset,
        reach=records["reach"].astype(np.float64),
        axis=records["axis"].astype(np.float64) @ rotation.T,
        cone_angle=records["cone_angle"].astype(np.float64),
    )
