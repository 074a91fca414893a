"""The environment pass: what domes show behind the geometry, and their light on it where no directions stand for them.

Directions drawn from the sky light the geometry like distant lights, with shadows (passes/emitters.py); this pass then
draws the background, and the sky's image in lobes too sharp for them, as far as geometry leaves it open
(passes/sky_visibility.py). A frame of one sample and one point a light has no directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.outputs import output_defines, outputs_source
from defshade_cli.gpu.planes import Plane, read_source
from defshade_cli.gpu.render_space import space_defines
from defshade_cli.image.environment import sky_of
from defshade_cli.image.render_space import REC709, RenderSpace
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.passes.linking import ALL_LINKED
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.sky_textures import SkyTextures
from defshade_cli.passes.sky_visibility import SkyVisibility
from defshade_cli.plan import Plan, PlannedLight
from defshade_cli.scene.environment import Environment
from defshade_cli.scene.light import DomeLight
from defshade_cli.settings import Layout
from defshade_cli.spaces import rigid


@dataclass(frozen=True, slots=True)
class EnvironmentVariant:
    """What the pass is compiled for.

    analytic: light the geometry too.  background: show the sky.  occlusion: geometry hides the sky from sharp lobes.
    rays: lobes are left to them.
    """

    planes: tuple[Plane, ...]
    layout: Layout
    orthographic: bool
    analytic: bool
    background: bool
    occlusion: bool = False
    rays: bool = False
    outputs: tuple[str, ...] = ()
    groups: int = 0
    space: RenderSpace = REC709

    @classmethod
    def of(cls, plan: Plan, dome: PlannedLight) -> EnvironmentVariant:
        """What the shader of a dome must know of the plan."""
        orthographic = plan.camera.projection == "orthographic"
        shows = dome.points == 0, plan.background, plan.hides_sky(dome), plan.sky_rays > 0
        return cls(plan.planes, plan.layout, orthographic, *shows, plan.outputs, plan.most_groups, plan.render_space)

    @property
    def defines(self) -> list[str]:
        """The shader's macros."""
        flags = ["ORTHOGRAPHIC"] * self.orthographic + ["ANALYTIC"] * self.analytic + ["BACKGROUND"] * self.background
        flags += ["OCCLUSION"] * self.occlusion + ["SKY_RAYS"] * self.rays
        return (
            [plane.define for plane in self.planes] + flags + space_defines(self.space) + output_defines(self.outputs)
        )


class EnvironmentPass:
    """Compiled for one variant."""

    def __init__(self, gpu: Gpu, variant: EnvironmentVariant, screen: Screen, textures: SkyTextures) -> None:
        self._context, self._textures = gpu.context, textures
        generated = {
            "generated/planes.glsl": read_source(variant.planes, variant.layout),
            "generated/outputs.glsl": outputs_source(variant.outputs, variant.groups),
        }
        files = ("screen.vert", "environment.frag")
        self._program = gpu.shaders.program(*files, defines=variant.defines, generated=generated)
        self._screen, self._array = screen, screen.array(self._program)

    def draw(
        self,
        planned: PlannedLight,
        gbuffer: GBuffer,
        targets: LightTargets,
        visibility: SkyVisibility | None = None,
        first_link: int = ALL_LINKED,
    ) -> None:
        """Add a dome to the targets. visibility: of skies, where some are hidden.  first_link: place of its bits."""
        dome = planned.light
        assert isinstance(dome, DomeLight)
        targets.of(planned.groups).use()
        self._context.enable_only(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE
        sky = sky_of(dome)
        gbuffer.bind(self._program, sky=self._textures.image(sky), **(visibility.textures if visibility else {}))
        for name, value in {**dome_uniforms(dome, sky), "first_link": first_link}.items():
            if name in self._program:
                self._program[name] = value
        self._screen.draw(self._array)


def dome_uniforms(dome: DomeLight, sky: Environment) -> dict[str, object]:
    """What shaders/lib/environment.glsl reads, and the response."""
    rotation = rigid(dome.world_from_light)[:3, :3]
    return {
        "sky_from_relative": tuple(rotation.ravel()),  # the transpose of a rotation, column by column
        "sky_emission": tuple(dome.emission),
        "irradiance_sh": [tuple(row) for row in sky.irradiance_sh],
        "response": (dome.diffuse, dome.specular),
    }
