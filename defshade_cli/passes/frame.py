"""The targets of a frame, kept from one frame to the next while their size and format stay."""

from __future__ import annotations

from typing import Any

import moderngl

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import Plane
from defshade_cli.gpu.targets import Target, allocate
from defshade_cli.passes.gbuffer import GBuffer, make_gbuffer
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.plan import Plan
from defshade_cli.settings import Layout

Size = tuple[int, int]


class Frame:
    """Hands out targets of one size; another size frees them all."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._size: Size = (0, 0)
        self._gbuffers: dict[tuple[tuple[Plane, ...], Layout], GBuffer] = {}
        self._radiance: dict[tuple[str, GBuffer | None], Target] = {}
        self._lights: tuple[tuple[Any, ...], LightTargets | None] = (), None
        self._tiles: dict[str, Target] = {}
        self._runs: moderngl.Texture | None = None

    def gbuffer(self, size: Size, planes: tuple[Plane, ...], layout: Layout) -> GBuffer:
        """The GBuffer of (width, height) in a layout, as last drawn. Raises GpuError."""
        self._resize(size)
        if (planes, layout) not in self._gbuffers:
            self._gbuffers[planes, layout] = make_gbuffer(self._gpu, size, planes, layout)
        return self._gbuffers[planes, layout]

    def spare(self, gbuffer: GBuffer) -> None:
        """Free its planes: nothing reads them any more. Whatever is drawn next has all targets made anew."""
        gbuffer.target.release()
        self._size = (0, 0)

    def radiance(self, name: str, size: Size, gbuffer: GBuffer | None = None, components: int = 4) -> Target:
        """A float target with one texture "radiance"; it tests against the depth of `gbuffer` where given.

        Raises GpuError.
        """
        self._resize(size)
        key = name, gbuffer
        if key not in self._radiance:
            depth = gbuffer.target.depth if gbuffer else None
            self._radiance[key] = allocate(self._gpu, size, {"radiance": (components, "f4")}, depth)
        return self._radiance[key]

    def of_tiles(self, name: str, components: int, tiles: Size, dtype: str = "f4") -> Target:
        """A texture `name` of so many numbers for each of (columns, rows) tiles, or one a word. Raises GpuError."""
        known = self._tiles.get(name)
        if known is None or known.framebuffer.size != tiles:
            if known:
                known.release()
            self._tiles[name] = allocate(self._gpu, tiles, dict.fromkeys(name.split(), (components, dtype)))
        return self._tiles[name]

    def tile_runs(self, tiles: Size) -> moderngl.Texture:
        """A texture of two integers for each of (columns, rows) tiles."""
        if self._runs is None or self._runs.size != tiles:
            if self._runs:
                self._runs.release()
            self._runs = self._gpu.context.texture(tiles, 2, dtype="u4")
            self._runs.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return self._runs

    def light_targets(self, radiance: Target, plan: Plan) -> LightTargets:
        """For the plan's lights, behind the radiance of a sample; those of another kind of plan are freed."""
        kind = radiance, plan.outputs, plan.groups
        known, targets = self._lights
        if targets is None or known != kind:
            if targets:
                targets.release()
            targets = LightTargets(self._gpu, radiance, plan)
            self._lights = kind, targets
        return targets

    def _resize(self, size: Size) -> None:
        if size == self._size:
            return
        if self._lights[1]:
            self._lights[1].release()
        self._lights = (), None
        for target in [*self._radiance.values(), *(g.target for g in self._gbuffers.values())]:
            target.release()
        for gbuffer in self._gbuffers.values():
            if gbuffer.target.depth:
                gbuffer.target.depth.release()
        self._radiance, self._gbuffers, self._size = {}, {}, size
