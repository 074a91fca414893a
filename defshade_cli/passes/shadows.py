"""Shadow maps: the scene as one sample of each light sees it, side by side in an atlas.

Maps are moved by a fraction of a texel every sample, so that their grid averages out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.buffers import SHADOW_BLOCK, RecordBuffer
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.draw_list import CASTER_FRONTS, DrawList
from defshade_cli.gpu.render_space import space_defines
from defshade_cli.gpu.textures import textures_source
from defshade_cli.image.render_space import REC709, RenderSpace
from defshade_cli.passes.coarse_maps import divided_runs
from defshade_cli.passes.culling import CommandBuffer, is_clear_of, may_see
from defshade_cli.passes.shadow_atlas import ShadowAtlas, places_from_relative
from defshade_cli.passes.shadow_changes import MapChange, Region, map_change, window_of
from defshade_cli.passes.shadow_maps import MapRequest, Maps, MapTarget, shadow_atlas
from defshade_cli.plan import Plan
from defshade_cli.scene.camera import Camera

_DEPTH_OFFSET = (0.0, -1.0)
"""Of what a map stores, in slopes a texel and in steps of depth: lib/shadow.glsl follows slopes itself."""

_COARSE_SLOPES = math.sqrt(2.0)
"""Of coarser casters, for each texel that they may be off; a driver takes the greater of both axes' slopes."""


@dataclass(frozen=True, slots=True)
class ShadowVariant:
    """What the pass is compiled for: the terms of GBufferVariant. linked: a light chooses its casters."""

    cutout: bool
    transparent: bool
    color_varies: bool
    texture_groups: int
    linked: bool
    space: RenderSpace = REC709
    many_uvs: bool = False

    @classmethod
    def of(cls, draws: DrawList, plan: Plan) -> ShadowVariant:
        """For what is drawn."""
        return cls(
            plan.cutout,
            plan.transparent,
            draws.color_varies,
            draws.texture_groups,
            plan.shadow_linked,
            plan.render_space,
            draws.many_uvs,
        )

    @property
    def defines(self) -> list[str]:
        """The shader's macros."""
        read = ["TRANSPARENT"] * self.transparent + ["DISPLAY_COLOR_VARIES"] * self.color_varies
        read += ["TEXTURES"] * bool(self.texture_groups) + ["MANY_UVS"] * self.many_uvs + space_defines(self.space)
        return (["CUTOUT", *read] if self.cutout else []) + ["LINKS"] * self.linked


@dataclass(frozen=True, slots=True, eq=False)
class _Turn:
    """What maps draw together.  fronts: one of CASTER_FRONTS.  coarse: of coarser casters."""

    program: moderngl.Program
    fronts: int
    coarse: bool = False


class ShadowPass:
    """Draws shadow maps into atlases; what one call draws the next of the same number overwrites."""

    def __init__(self, gpu: Gpu, variant: ShadowVariant) -> None:
        generated = {"generated/textures.glsl": textures_source(variant.texture_groups)}
        self._context = gpu.context
        kinds = [replace(variant, cutout=False), variant][: 1 + variant.cutout]
        programs = [
            gpu.shaders.program("shadow.vert", "shadow.frag", defines=kind.defines, generated=generated)
            for kind in kinds
        ]
        solid, *thin = programs
        self._turns = [_Turn(solid, fronts, coarse) for coarse in (True, False) for fronts in CASTER_FRONTS]
        self._turns += [_Turn(program, 0) for program in thin]
        self._targets = cache(lambda number: MapTarget(gpu))
        self._records = RecordBuffer(gpu, SHADOW_BLOCK, uniform=True)
        self._commands = CommandBuffer(gpu)

    def draw(self, draws: DrawList, request: MapRequest) -> ShadowAtlas:
        """All that is asked for."""
        target, maps = self._targets(request.number), Maps.of(request, draws)
        target.begin(maps)
        self._draw_maps(draws, target, maps, dict.fromkeys(range(len(maps.cameras))))
        return shadow_atlas(target, request)

    def redraw(
        self, draws: DrawList, request: MapRequest, boxes: NDArray[np.float64]
    ) -> tuple[ShadowAtlas, list[MapChange]] | None:
        """The same, but only what boxes (N, 2, 3) relative to the eye cover of maps that are there; and what changes.

        None where the atlas holds others.
        """
        target, maps, side = self._targets(request.number), Maps.of(request, draws), request.resolution
        if not maps.are_alike(target.maps):
            return None
        places = [places_from_relative(camera, side) for camera in maps.cameras]
        found = {slot: window_of(boxes, place, side) for slot, place in enumerate(places)}
        windows = {slot: window for slot, window in found.items() if window}
        target.use()
        before = [target.read(slot, window.read) for slot, window in windows.items()]
        for slot, window in windows.items():
            target.empty(slot, window.drawn)
        self._draw_maps(draws, target, maps, {slot: window.drawn for slot, window in windows.items()})
        after = [target.read(slot, window.read) for slot, window in windows.items()]
        changes = [
            map_change(old, new, window, places[slot], side)
            for (slot, window), old, new in zip(windows.items(), before, after, strict=True)
        ]
        return shadow_atlas(target, request), [change for change in changes if change]

    def show(self, atlas: ShadowAtlas) -> None:
        """Let shaders find its maps."""
        self._records.write(atlas.records)

    def _draw_maps(self, draws: DrawList, target: MapTarget, maps: Maps, parts: Mapping[int, Region | None]) -> None:
        """Parts of maps, or all of them, with the commands that they may see, those first that let nothing through."""
        if not parts:
            return
        places = draws.coarse.places(maps.levels)
        runs = [self._runs(draws, maps, slot, part, places[slot]) for slot, part in parts.items()]
        self._commands.write([run for each in runs for run in each])
        self._context.depth_func = ">"
        for number, turn in enumerate(self._turns):
            used = {slot: run for run, slot in enumerate(parts) if not self._commands.is_empty(self._run(run, number))}
            if used:
                self._show(turn, maps)
                indices = draws.coarse.triangles.indices if turn.coarse else draws.indices
                array = self._context.vertex_array(turn.program, draws.vertices_of(turn.program), indices)
                for slot, run in used.items():
                    target.keep_to(slot, parts[slot])
                    _set_map(turn, maps, slot)
                    self._commands.render(array, self._run(run, number))
                array.release()
        target.keep_to(0, None)
        self._context.polygon_offset = 0.0, 0.0

    def _run(self, number: int, turn: int) -> int:
        """Of the commands, that the number-th map draws in a turn."""
        return number * len(self._turns) + turn

    def _runs(
        self, draws: DrawList, maps: Maps, slot: int, part: Region | None, places: NDArray[np.intp]
    ) -> list[NDArray[Any]]:
        """What a map, or a part of it, may see in each turn. places: of its coarser casters."""
        closed, fronts = np.flatnonzero(draws.fronts), np.zeros_like(draws.fronts)
        clear = closed[is_clear_of(maps.cameras[slot], draws.corners[closed])]
        fronts[clear] = draws.fronts[clear]
        seen = may_see(maps.clip_of(slot, part), draws.corners)
        whole, coarse = divided_runs(draws, places, seen, fronts)
        return [*coarse, *draws.caster_runs(whole, fronts)][: len(self._turns)]

    def _show(self, turn: _Turn, maps: Maps) -> None:
        """Both sides of all faces, or those alone that are fronts: see DrawList.fronts."""
        self._context.enable_only(moderngl.DEPTH_TEST | (moderngl.CULL_FACE if turn.fronts else moderngl.NOTHING))
        self._context.cull_face = "front" if turn.fronts < 0 else "back"
        slopes, steps = _DEPTH_OFFSET
        self._context.polygon_offset = slopes - _COARSE_SLOPES * maps.coarse_share * turn.coarse, steps


def _set_map(turn: _Turn, maps: Maps, slot: int) -> None:
    program, clip = turn.program, maps.deeper(slot) if turn.coarse else maps.clips[slot]
    program["clip_from_relative"] = tuple(clip.ravel().tolist())
    if "towards_light" in program:
        program["towards_light"] = _towards(maps.cameras[slot])
    if "first_caster" in program:
        program["first_caster"] = int(maps.casters[slot])


def _towards(camera: Camera) -> tuple[float, ...]:
    """The light of a map: (position, 1), or (direction, 0) of one that is far away."""
    distant = camera.projection == "orthographic"
    return (*camera.world_from_camera[:3, 2 if distant else 3].tolist(), 0.0 if distant else 1.0)
