"""How much of the sky geometry leaves open to each pixel's sharp lobes, learnt from the directions drawn so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import moderngl

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import read_source
from defshade_cli.gpu.targets import Target
from defshade_cli.passes.frame import Frame, Size
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.lighting import LightingVariant
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.shadow_atlas import ShadowAtlas, shadow_source
from defshade_cli.plan import Plan, PlannedLight


@dataclass(frozen=True, slots=True, eq=False)
class SkyVisibility:
    """What is known of it: with this sample, and before."""

    known: Target
    before: Target

    @classmethod
    def of(cls, frame: Frame, size: Size) -> SkyVisibility:
        """Nothing yet, of an image of (width, height). Raises GpuError."""
        known, before = (frame.radiance(f"sky visibility {which}", size) for which in ("known", "before"))
        known.framebuffer.clear()
        return cls(known, before)

    @property
    def textures(self) -> dict[str, moderngl.Texture]:
        """By the names of their samplers."""
        targets = {"sky_visibility": self.known, "sky_visibility_before": self.before}
        return {name: target.textures["radiance"] for name, target in targets.items()}


class SkyVisibilityPass:
    """Adds what reaches sharp lobes, what would without shadows, and the number of directions."""

    def __init__(self, gpu: Gpu, variant: LightingVariant, screen: Screen) -> None:
        self._context, self._screen = gpu.context, screen
        variant = replace(variant, shadows=("map",))
        generated = {"generated/planes.glsl": read_source(variant.planes, variant.layout)}
        generated |= shadow_source(variant.shadows)
        files = ("light_quad.vert", "sky_visibility.frag")
        program = gpu.shaders.program(*files, defines=[*variant.defines, "VOLUME_QUAD"], generated=generated)
        self._array = screen.array(program)

    def begin_sample(self, visibility: SkyVisibility) -> None:
        """What is known becomes what was before."""
        self._context.copy_framebuffer(visibility.before.framebuffer, visibility.known.framebuffer)

    def add(
        self,
        lights: Sequence[PlannedLight],
        plan: Plan,
        gbuffer: GBuffer,
        visibility: SkyVisibility,
        shadows: ShadowAtlas,
    ) -> None:
        """Those of `lights`, whose records are bound, that are skies with shadows."""
        visibility.known.framebuffer.use()
        self._context.enable_only(moderngl.BLEND)
        self._context.blend_func = moderngl.ONE, moderngl.ONE
        gbuffer.bind(self._array.program, shadow_atlas=shadows.depth)
        for number, planned in enumerate(lights):
            if plan.hides_sky(planned):
                self._array.program["first_light"] = number
                self._screen.draw(self._array)
