"""The environment pass: what domes show behind the geometry, and their light on it where no directions stand for them.

Directions drawn from the sky light the geometry like distant lights, with shadows (passes/emitters.py); this pass then
draws the background, and the sky's image in lobes too sharp for them, as far as geometry leaves it open
(passes/sky_visibility.py). A frame of one sample and one point a light has no directions.
"""

from __future__ import annotations

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.outputs import output_defines, outputs_source
from defshade_cli.gpu.planes import Plane, read_source
from defshade_cli.gpu.render_space import space_defines
from defshade_cli.image.render_space import REC709, RenderSpace
from defshade_cli.passes.dome_program import DomeProgram
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.passes.linking import ALL_LINKED
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.sky_textures import SkyTextures
from defshade_cli.passes.sky_visibility import SkyVisibility
from defshade_cli.plan import Plan, PlannedLight
from defshade_cli.settings import Layout


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
        shows = dome.points == 0, plan.background, plan.hides_sky(dome), dome.by_rays
        return cls(plan.planes, plan.layout, orthographic, *shows, plan.outputs, plan.most_groups, plan.render_space)

    @property
    def defines(self) -> list[str]:
        """The shader's macros."""
        flags = ["ORTHOGRAPHIC"] * self.orthographic + ["ANALYTIC"] * self.analytic + ["BACKGROUND"] * self.background
        flags += ["OCCLUSION"] * self.occlusion + ["LOBE_RAYS"] * self.rays
        return (
            [plane.define for plane in self.planes] + flags + space_defines(self.space) + output_defines(self.outputs)
        )


class EnvironmentPass:
    """Compiled for one variant."""

    def __init__(self, gpu: Gpu, variant: EnvironmentVariant, screen: Screen, textures: SkyTextures) -> None:
        generated = {
            "generated/planes.glsl": read_source(variant.planes, variant.layout),
            "generated/outputs.glsl": outputs_source(variant.outputs, variant.groups),
        }
        self._dome = DomeProgram(gpu, "environment.frag", variant.defines, generated, screen, textures)

    def draw(
        self,
        planned: PlannedLight,
        gbuffer: GBuffer,
        targets: LightTargets,
        visibility: SkyVisibility | None = None,
        first_link: int = ALL_LINKED,
    ) -> None:
        """Add a dome to the targets. visibility: of skies, where some are hidden.  first_link: place of its bits."""
        textures = visibility.textures if visibility else {}
        self._dome.add(planned, gbuffer, targets, {"first_link": first_link}, textures)
