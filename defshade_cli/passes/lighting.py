"""The lighting pass: every light is a volume, drawn instanced and blended over what the GBuffer says.

Back faces are drawn, and a fragment passes where the volume's far side lies behind the surface: right with the
camera inside the volume and with the volume crossing the near plane. Depth clamping keeps a far side that the far
plane would cut off.
"""

from __future__ import annotations

from collections.abc import Sequence

import moderngl

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import DEPTH_CLAMP, Gpu
from defshade_cli.gpu.outputs import output_defines, outputs_source
from defshade_cli.gpu.planes import Plane, read_source, uses_standard_depth
from defshade_cli.gpu.render_space import space_defines
from defshade_cli.image.render_space import REC709, RenderSpace
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.shadow_atlas import ShadowAtlas, ShadowKind, shadow_source
from defshade_cli.passes.tables import NO_TABLES, LightTables
from defshade_cli.plan import Plan, PlannedLight, Volume
from defshade_cli.settings import Layout, Shading


@dataclass(frozen=True, slots=True)
class LightingVariant:
    """What the pass is compiled for.

    responses: some light shows in one lobe more than in the other.
    shaped: cones, focus or profiles of IES.  profiles: some point does not shine alike all around.
    cell_parts: a side of the cell of its pixel that a sample stands for, and points stand for some area of their light;
        0 for the plain equation.
    sky: points of a dome.  lobe_rays: lobes see some light by rays too.
    volumes: the kinds that some light has.  outputs: layers beside the radiance.  groups: those that one light is in.
    shared: neighbouring pixels know of the shadows, see passes/shared_shadows.py.
    """

    planes: tuple[Plane, ...]
    layout: Layout
    shading: Shading
    orthographic: bool
    shadows: tuple[ShadowKind, ...]
    shadow_styles: bool
    ies: bool
    responses: bool
    shaped: bool
    profiles: bool
    cell_parts: int
    sky: bool
    lobe_rays: bool
    volumes: tuple[Volume, ...]
    outputs: tuple[str, ...] = ()
    groups: int = 0
    space: RenderSpace = REC709
    shared: bool = False

    @classmethod
    def of(
        cls,
        plan: Plan,
        chosen: Sequence[PlannedLight] | None = None,
        shadows: tuple[ShadowKind, ...] = ("map", "cube"),
    ) -> LightingVariant:
        """For some of the plan's lights with some kinds of shadows, or for all."""
        chosen = plan.lights if chosen is None else chosen
        orthographic = plan.camera.projection == "orthographic"
        lights = [planned.light for planned in chosen]
        patches = plan.cell_parts > 0
        return cls(
            plan.planes,
            plan.layout,
            plan.shading,
            orthographic,
            shadows if plan.shadows else (),
            plan.shadow_styles,
            any(light.shaping and light.shaping.ies for light in lights),
            any((light.diffuse, light.specular) != (1.0, 1.0) for light in lights),
            any(light.shaping for light in lights),
            patches or any(light.profile != "uniform" for light in lights),
            plan.cell_parts,
            patches and any(light.kind == "dome" for light in lights),
            any(planned.by_rays for planned in chosen),
            tuple(dict.fromkeys(planned.volume for planned in chosen)),
            plan.outputs,
            max((len(planned.groups) for planned in chosen), default=0),
            plan.render_space,
        )

    @property
    def defines(self) -> list[str]:
        """The shader's macros."""
        flags = ["CLASSIC"] * (self.shading == "classic") + ["ORTHOGRAPHIC"] * self.orthographic
        flags += (
            self.shadow_defines
            + ["SHADOW_STYLES"] * self.shadow_styles
            + ["IES"] * self.ies
            + ["RESPONSES"] * self.responses
            + ["SHAPED"] * self.shaped
            + ["PROFILES"] * self.profiles
            + ["PATCHES"] * bool(self.cell_parts)
            + [f"CELL_PARTS {self.cell_parts}"] * (self.cell_parts > 1)
            + ["SKY"] * self.sky
            + ["LOBE_RAYS"] * self.lobe_rays
            + ["SHARED_SHADOWS"] * self.shared
            + space_defines(self.space)
        )
        return [plane.define for plane in self.planes] + flags + output_defines(self.outputs)

    @property
    def shadow_defines(self) -> list[str]:
        """Those of a shader that looks at shadows alone."""
        return ["SHADOWS"] * bool(self.shadows) + [f"SHADOW_{kind.upper()}S" for kind in self.shadows]

    @property
    def generated(self) -> dict[str, str]:
        """What a shader that adds light to the targets includes."""
        return {
            "generated/planes.glsl": read_source(self.planes, self.layout),
            "generated/outputs.glsl": outputs_source(self.outputs, self.groups),
            **shadow_source(self.shadows),
        }

    @property
    def distances(self) -> list[str]:
        """The macros of a shader for all the volumes at once."""
        return ["VOLUME_QUAD" if self.volumes == ("quad",) else "VOLUMES_MIXED"] * ("quad" in self.volumes)


class LightingPass:
    """Compiled for one variant."""

    def __init__(self, gpu: Gpu, variant: LightingVariant, screen: Screen) -> None:
        self._context, self._screen = gpu.context, screen
        self._volumes: dict[Volume, moderngl.VertexArray] = {}
        for volume in variant.volumes:
            defines = variant.defines + ["VOLUME_QUAD"] * (volume == "quad")
            files = (f"light_{volume}.vert", "lighting.frag")
            program = gpu.shaders.program(*files, defines=defines, generated=variant.generated)
            self._volumes[volume] = screen.array(program) if volume == "quad" else volume_array(gpu, volume, program)

    def add(
        self,
        lights: Sequence[PlannedLight],
        gbuffer: GBuffer,
        targets: LightTargets,
        shadows: ShadowAtlas | None = None,
        tables: LightTables = NO_TABLES,
    ) -> None:
        """The volumes of `lights`, whose records are bound, on top of what the targets hold."""
        self._context.enable_direct(DEPTH_CLAMP)
        self._context.blend_func = moderngl.ONE, moderngl.ONE
        self._context.cull_face = "front"
        self._context.depth_func = ">" if uses_standard_depth(gbuffer.layout) else "<"
        alike = [(planned.volume, planned.groups) for planned in lights]
        for volume, groups in dict.fromkeys(alike):
            targets.of(groups).use()
            maps = shadows.bind(self._volumes[volume].program) if shadows else None
            gbuffer.bind(self._volumes[volume].program, shadow_atlas=maps, ies_tables=tables.candela)
            draw = self._draw_quads if volume == "quad" else self._draw_volumes
            draw(self._volumes[volume], alike.index((volume, groups)), alike.count((volume, groups)))
        self._context.disable_direct(DEPTH_CLAMP)

    def _draw_quads(self, array: moderngl.VertexArray, first: int, count: int) -> None:
        self._context.enable_only(moderngl.BLEND)
        for light in range(first, first + count):
            array.program["first_light"] = light
            self._screen.draw(array)

    def _draw_volumes(self, array: moderngl.VertexArray, first: int, count: int) -> None:
        self._context.enable_only(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        array.program["first_light"] = first
        array.render(instances=count)


def volume_array(gpu: Gpu, volume: Volume, program: moderngl.Program) -> moderngl.VertexArray:
    """The polyhedron around a sphere or a cone, for a program that reads its `corner`s."""
    from defshade_cli.passes.volumes import cone_volume, sphere_volume

    corners, triangles = sphere_volume() if volume == "sphere" else cone_volume()
    vertices = gpu.keep(gpu.context.buffer(corners.tobytes()))
    indices = gpu.keep(gpu.context.buffer(triangles.tobytes()))
    return gpu.keep(gpu.context.vertex_array(program, [(vertices, "3f", "corner")], indices))
