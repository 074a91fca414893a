"""Shadow maps: the scene as one sample of each light sees it, side by side in an atlas.

Maps are moved by a fraction of a texel every sample, so that their grid averages out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.render_space import space_defines
from defshade_cli.gpu.residence import SHADOW_BLOCK, DrawList, RecordBuffer
from defshade_cli.gpu.textures import textures_source
from defshade_cli.image.render_space import REC709, RenderSpace
from defshade_cli.passes.culling import CommandBuffer, may_see
from defshade_cli.passes.shadow_atlas import (
    ATLAS,
    ShadowAtlas,
    clip_from_relative,
    cube_uniforms,
    map_records,
    placed,
    viewport,
)
from defshade_cli.plan.shadow_maps import CUBE_FACES
from defshade_cli.scene.camera import Camera

_DEPTH_OFFSET = (0.0, -1.0)
"""Of what a map stores, in slopes a texel and in steps of depth: lib/shadow.glsl follows slopes itself."""


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

    @property
    def defines(self) -> list[str]:
        """The shader's macros."""
        read = ["TRANSPARENT"] * self.transparent + ["DISPLAY_COLOR_VARIES"] * self.color_varies
        read += ["TEXTURES"] * bool(self.texture_groups) + ["MANY_UVS"] * self.many_uvs + space_defines(self.space)
        return (["CUTOUT", *read] if self.cutout else []) + ["LINKS"] * self.linked


class ShadowPass:
    """Draws shadow maps into an atlas; what one call draws the next overwrites."""

    def __init__(self, gpu: Gpu, variant: ShadowVariant) -> None:
        generated = {"generated/textures.glsl": textures_source(variant.texture_groups)}
        self._context = gpu.context
        kinds = [replace(variant, cutout=False), variant][: 1 + variant.cutout]
        self._programs = [
            gpu.shaders.program("shadow.vert", "shadow.frag", defines=kind.defines, generated=generated)
            for kind in kinds
        ]
        self._depth = gpu.keep(gpu.depth_texture((ATLAS, ATLAS)))
        self._framebuffer = gpu.keep(gpu.context.framebuffer([], self._depth))
        self._records = RecordBuffer(gpu, SHADOW_BLOCK, uniform=True)
        self._commands = CommandBuffer(gpu)

    def draw(
        self,
        draws: DrawList,
        cameras: Sequence[tuple[Camera, ...]],
        resolution: int,
        jitter: tuple[float, float],
        casters: Sequence[int] = (),
    ) -> ShadowAtlas:
        """The maps of each light's cameras, no more than the atlas holds; a light may have none.

        resolution: texels along a map's side.  jitter: in texels.
        casters: of each light, the place of its casters' link bits; all cast where none are given.
        """
        count = np.array([len(light) for light in cameras], np.uint32)
        first = np.concatenate([[0], np.cumsum(count)[:-1]]).astype(np.uint32)
        maps = placed(cameras, resolution, jitter)
        self._framebuffer.use()
        if maps:
            columns = min(len(maps), ATLAS // resolution)
            rows = -(-len(maps) // columns)
            self._framebuffer.clear(depth=0.0, viewport=(0, 0, columns * resolution, rows * resolution))
            self._draw_maps(draws, maps, resolution, np.repeat(casters, count) if len(casters) else np.array([]))
        self._records.write(map_records(maps, first[count == 1], resolution))
        cubes = first[count == CUBE_FACES]
        uniforms = cube_uniforms(maps[cubes[0]], resolution) if len(cubes) else {}
        first_record = (np.cumsum(count == 1) - 1).astype(np.uint32)
        return ShadowAtlas(self._depth, first, count, first_record, uniforms)

    def _draw_maps(self, draws: DrawList, maps: Sequence[Camera], resolution: int, casters: NDArray[Any]) -> None:
        """Each map with the commands that it may see, those first that let nothing through."""
        kinds = len(self._programs)
        clips = [clip_from_relative(camera).T.astype(np.float32) for camera in maps]
        self._commands.write([run for clip in clips for run in draws.runs(may_see(clip, draws.corners))[:kinds]])
        self._context.enable_only(moderngl.DEPTH_TEST)
        self._context.depth_func = ">"
        self._context.polygon_offset = _DEPTH_OFFSET
        for kind, program in enumerate(self._programs):
            array = self._context.vertex_array(program, draws.vertices_of(program), draws.indices)
            for slot, clip in enumerate(clips):
                self._framebuffer.viewport = viewport(slot, resolution)
                program["clip_from_relative"] = tuple(clip.ravel().tolist())
                if "towards_light" in program:
                    program["towards_light"] = _towards(maps[slot])
                if "first_caster" in program:
                    program["first_caster"] = int(casters[slot])
                self._commands.render(array, slot * kinds + kind)
            array.release()
        self._context.polygon_offset = 0.0, 0.0


def _towards(camera: Camera) -> tuple[float, ...]:
    """The light of a map: (position, 1), or (direction, 0) of one that is far away."""
    distant = camera.projection == "orthographic"
    return (*camera.world_from_camera[:3, 2 if distant else 3].tolist(), 0.0 if distant else 1.0)
