"""The GBuffer pass: opaque geometry into the planes, nearest surface wins."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.draw_list import DrawList
from defshade_cli.gpu.planes import Plane, integer_attachments, planes_read, uses_standard_depth, write_source
from defshade_cli.gpu.render_space import space_defines
from defshade_cli.gpu.shaders import set_textures
from defshade_cli.gpu.targets import NOWHERE, Part, Target, allocate
from defshade_cli.gpu.textures import textures_source
from defshade_cli.image.render_space import REC709, RenderSpace
from defshade_cli.passes.culling import CommandBuffer, clip_of_part, may_see
from defshade_cli.passes.screen import TileMask
from defshade_cli.plan import Plan
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.window import WHOLE_IMAGE
from defshade_cli.settings import Layout


@dataclass(frozen=True, slots=True, eq=False)
class GBuffer:
    """Planes and depth of one layout."""

    target: Target
    planes: tuple[Plane, ...]
    layout: Layout

    def bind(self, program: moderngl.Program, **others: moderngl.Texture | moderngl.TextureArray | None) -> None:
        """Let `program` read the planes, and `others` by the names of their samplers, where it has those."""
        for unit, plane in enumerate(planes_read(self.planes, self.layout)):
            self.target.textures[plane.name].bind_to_image(unit, read=True, write=False)
        set_textures(program, {"plane_depth": self.target.depth, **others})


def make_gbuffer(gpu: Gpu, size: tuple[int, int], planes: tuple[Plane, ...], layout: Layout) -> GBuffer:
    """An empty GBuffer of (width, height). Raises GpuError."""
    formats = {p.name: (p.components, p.encodings[layout].dtype) for p in planes}
    return GBuffer(allocate(gpu, size, formats, gpu.depth_texture(size)), planes, layout)


_CLIP_DISTANCE0 = 0x3000
"""GL_CLIP_DISTANCE0, which moderngl has no name for."""


@dataclass(frozen=True, slots=True)
class GBufferVariant:
    """What the pass is compiled for.

    cutout: some opacity is below 1; transparent: and scales the diffuse alone; color_varies: displayColor a vertex.
    texture_groups: 0 without textures.  many_uvs: see DrawList.
    clipping_planes: how many the camera has.
    """

    planes: tuple[Plane, ...]
    layout: Layout
    cutout: bool
    color_varies: bool
    texture_groups: int = 0
    space: RenderSpace = REC709
    clipping_planes: int = 0
    transparent: bool = False
    orthographic: bool = False
    many_uvs: bool = False

    @classmethod
    def of(cls, draws: DrawList, plan: Plan, gbuffer: GBuffer) -> GBufferVariant:
        """For what is drawn, and where."""
        return cls(
            gbuffer.planes,
            gbuffer.layout,
            plan.cutout,
            draws.color_varies,
            draws.texture_groups,
            plan.render_space,
            len(plan.camera.clipping_planes),
            plan.transparent,
            plan.camera.projection == "orthographic",
            draws.many_uvs,
        )

    @property
    def defines(self) -> list[str]:
        """The shader's macros."""
        flags = ["CUTOUT"] * self.cutout + ["DISPLAY_COLOR_VARIES"] * self.color_varies
        flags += ["TRANSPARENT", "POSITION"] * self.transparent + ["ORTHOGRAPHIC"] * self.orthographic
        flags += ["TEXTURES", "POSITION"] * bool(self.texture_groups) + ["MANY_UVS"] * self.many_uvs
        flags += [f"CLIPPING_PLANES {self.clipping_planes}"] * bool(self.clipping_planes)
        inputs = [name for plane in self.planes for name in plane.inputs]
        return list(dict.fromkeys([plane.define for plane in self.planes] + flags + inputs)) + space_defines(self.space)


class GBufferPass:
    """Compiled for one variant."""

    def __init__(self, gpu: Gpu, variant: GBufferVariant) -> None:
        generated = {
            "generated/planes.glsl": write_source(variant.planes, variant.layout),
            "generated/textures.glsl": textures_source(variant.texture_groups),
        }
        self._gpu, self._context, self._commands = gpu, gpu.context, CommandBuffer(gpu)
        self._clip_distances = range(_CLIP_DISTANCE0, _CLIP_DISTANCE0 + variant.clipping_planes)
        solid = replace(variant, cutout=False, transparent=False)
        self._programs = [
            gpu.shaders.program("gbuffer.vert", "gbuffer.frag", defines=kind.defines, generated=generated)
            for kind in [solid, variant][: 1 + variant.cutout]
        ]

    def draw(
        self,
        draws: DrawList,
        gbuffer: GBuffer,
        mask: TileMask,
        camera: Camera,
        clip_from_relative: NDArray[np.float32],
        *,
        whole: bool = False,
    ) -> None:
        """What `camera` sees of `draws` (D,) by the bound View: a multi-draw of what is solid, one of what is not.

        Both sides of every face.

        Under the mask the depth is the background's afterwards, and the planes are as they were unless `whole`.
        Around the part that a mask keeps to, all is as it was.
        """
        standard = uses_standard_depth(gbuffer.layout)
        nearest, background = (0.0, 1.0) if standard else (1.0, 0.0)
        part = WHOLE_IMAGE if whole else mask.open
        if part == NOWHERE:
            return
        self._clear(gbuffer, background, part, around=not mask.keeps)
        if not whole:
            mask.shut(gbuffer.target, nearest)
        gbuffer.target.framebuffer.use()
        self._context.enable_only(moderngl.DEPTH_TEST)
        self._context.depth_func = "<" if standard else ">"
        self._commands.write(draws.runs(may_see(clip_of_part(clip_from_relative, part), draws.corners)))
        for run, program in enumerate(self._programs):
            draws.textures.bind(program)
            self._clip(camera, program)
            array = self._context.vertex_array(program, draws.vertices_of(program), draws.indices)
            self._commands.render(array, run)
            array.release()
        for distance in self._clip_distances:
            self._context.disable_direct(distance)
        mask.empty(gbuffer.target, background)
        gbuffer.target.keep_to(WHOLE_IMAGE)

    def _clear(self, gbuffer: GBuffer, background: float, part: Part, *, around: bool) -> None:
        """The planes of a part of the image, to which draws keep from now on; depths and numbers `around` it too."""
        target = gbuffer.target
        if part != WHOLE_IMAGE and around:
            with target.colours_kept():
                target.framebuffer.clear(depth=background)
        target.framebuffer.use()
        if not around:
            target.keep_to(part)
        for attachment in integer_attachments(gbuffer.planes, gbuffer.layout):
            self._gpu.clear_integers(attachment)
        target.keep_to(part)
        target.framebuffer.clear(depth=background)

    def _clip(self, camera: Camera, program: moderngl.Program) -> None:
        """By the camera's clipping planes, in relative space. Shadows are cast by what they cut off, as in Storm."""
        for distance in self._clip_distances:
            self._context.enable_direct(distance)
        if self._clip_distances:
            planes = camera.clipping_planes.copy()
            planes[:, :3] @= camera.world_from_camera[:3, :3].T
            values = [tuple(plane) for plane in planes.tolist()]
            program["clipping_planes"] = values if len(values) > 1 else values[0]
