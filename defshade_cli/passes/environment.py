"""The environment pass: what domes show behind the geometry, and their light on it where no directions stand for them.

Directions drawn from the sky light the geometry like distant lights, with shadows (passes/emitters.py); this pass then
draws the background, and the sky's image in lobes too sharp for them, as far as geometry leaves it open
(passes/sky_visibility.py). A frame of one sample and one point a light has no directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

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
from defshade_cli.passes.sky_visibility import SkyVisibility
from defshade_cli.plan import Plan, PlannedLight
from defshade_cli.scene.environment import Environment
from defshade_cli.scene.light import DomeLight
from defshade_cli.settings import Layout
from defshade_cli.spaces import rigid

_HALF_MAX = 65504.0


@dataclass(frozen=True, slots=True)
class EnvironmentVariant:
    """What the pass is compiled for.

    analytic: light the geometry too.  background: show the sky.  occlusion: geometry hides the sky from sharp lobes.
    """

    planes: tuple[Plane, ...]
    layout: Layout
    orthographic: bool
    analytic: bool
    background: bool
    occlusion: bool = False
    outputs: tuple[str, ...] = ()
    groups: int = 0
    space: RenderSpace = REC709

    @classmethod
    def of(cls, plan: Plan, dome: PlannedLight) -> EnvironmentVariant:
        """What the shader of a dome must know of the plan."""
        orthographic = plan.camera.projection == "orthographic"
        shows = dome.points == 0, plan.background, plan.hides_sky(dome)
        return cls(plan.planes, plan.layout, orthographic, *shows, plan.outputs, plan.most_groups, plan.render_space)

    @property
    def defines(self) -> list[str]:
        """The shader's macros."""
        flags = ["ORTHOGRAPHIC"] * self.orthographic + ["ANALYTIC"] * self.analytic + ["BACKGROUND"] * self.background
        flags += ["OCCLUSION"] * self.occlusion
        return (
            [plane.define for plane in self.planes] + flags + space_defines(self.space) + output_defines(self.outputs)
        )


class EnvironmentPass:
    """Compiled for one variant; keeps the skies it has drawn as textures."""

    def __init__(self, gpu: Gpu, variant: EnvironmentVariant, screen: Screen) -> None:
        self._gpu = gpu
        generated = {
            "generated/planes.glsl": read_source(variant.planes, variant.layout),
            "generated/outputs.glsl": outputs_source(variant.outputs, variant.groups),
        }
        files = ("screen.vert", "environment.frag")
        self._program = gpu.shaders.program(*files, defines=variant.defines, generated=generated)
        self._screen, self._array = screen, screen.array(self._program)
        self._skies: dict[Environment, moderngl.Texture] = {}

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
        self._gpu.context.enable_only(moderngl.BLEND)
        self._gpu.context.blend_func = moderngl.ONE, moderngl.ONE
        sky = sky_of(dome)
        gbuffer.bind(self._program, sky=self._texture(sky), **(visibility.textures if visibility else {}))
        for name, value in {**_uniforms(dome, sky), "first_link": first_link}.items():
            if name in self._program:
                self._program[name] = value
        self._screen.draw(self._array)

    def _texture(self, sky: Environment) -> moderngl.Texture:
        if sky not in self._skies:
            height, width = sky.radiance.shape[:2]
            pixels = np.minimum(sky.radiance, _HALF_MAX).astype(np.float16)
            texture = self._gpu.keep(
                self._gpu.context.texture((width, height), 3, pixels.tobytes(), dtype="f2", alignment=1)
            )
            texture.repeat_y = False
            texture.build_mipmaps()
            texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
            self._skies[sky] = self._gpu.keep(texture)
        return self._skies[sky]


def _uniforms(dome: DomeLight, sky: Environment) -> dict[str, object]:
    rotation = rigid(dome.world_from_light)[:3, :3]
    return {
        "sky_from_relative": tuple(rotation.ravel()),  # the transpose of a rotation, column by column
        "sky_emission": tuple(dome.emission),
        "irradiance_sh": [tuple(row) for row in sky.irradiance_sh],
        "response": (dome.diffuse, dome.specular),
    }
