"""How much of the sky geometry leaves open to each pixel's sharp lobes, learnt from the directions drawn so far."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.buffers import LIGHT_BLOCK, RecordBuffer
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import background_depth, read_source
from defshade_cli.gpu.targets import Target
from defshade_cli.passes.frame import Frame, Size
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_traits import Traits, common_traits, lights_source
from defshade_cli.passes.lighting import LightingVariant
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.shadow_atlas import ShadowAtlas, shadow_source
from defshade_cli.plan import Plan, PlannedLight

_MOST = 64
"""Directions a draw."""


@dataclass(frozen=True, slots=True, eq=False)
class SkyVisibility:
    """What is known of it: with this sample, and before."""

    known: Target
    before: Target

    @classmethod
    def of(cls, frame: Frame, size: Size, gbuffer: GBuffer) -> SkyVisibility:
        """Nothing yet, of an image of (width, height), where the GBuffer shows something. Raises GpuError."""
        known = frame.radiance("sky visibility known", size, gbuffer)
        before = frame.radiance("sky visibility before", size)
        known.framebuffer.depth_mask = False
        known.framebuffer.clear()
        return cls(known, before)

    @property
    def textures(self) -> dict[str, moderngl.Texture]:
        """By the names of their samplers."""
        targets = {"sky_visibility": self.known, "sky_visibility_before": self.before}
        return {name: target.textures["radiance"] for name, target in targets.items()}


class SkyVisibilityPass:
    """Adds what reaches sharp lobes, what would without shadows, and the number of directions."""

    def __init__(self, gpu: Gpu, screen: Screen) -> None:
        self._context, self._screen = gpu.context, screen
        self._block = RecordBuffer(gpu, LIGHT_BLOCK, uniform=True)
        self._array = cache(lambda *kind: screen.array(_compile(gpu, *kind)))

    def begin_sample(self, visibility: SkyVisibility) -> None:
        """What is known becomes what was before."""
        self._context.copy_framebuffer(visibility.before.framebuffer, visibility.known.framebuffer)

    def add(
        self,
        lights: Sequence[PlannedLight],
        records: NDArray[Any],
        plan: Plan,
        gbuffer: GBuffer,
        visibility: SkyVisibility,
        shadows: ShadowAtlas,
    ) -> None:
        """Those of `lights`, records (L,), that are skies with shadows.

        Each pixel looks up all shadows: a lobe may see one of them alone, and its edge is then as sharp as the lobe.
        """
        visibility.known.framebuffer.use()
        self._context.enable_only(moderngl.BLEND | moderngl.DEPTH_TEST)
        self._context.blend_func = moderngl.ONE, moderngl.ONE
        self._context.depth_func = "!="
        skies = np.flatnonzero([plan.hides_sky(planned) for planned in lights])
        for first in range(0, len(skies), _MOST):
            members = skies[first : first + _MOST]
            variant = LightingVariant.of(plan, [lights[number] for number in members], ("map",))
            array = self._array(variant, common_traits(records[members]))
            gbuffer.bind(array.program, shadow_atlas=shadows.depth)
            array.program["screen_depth"] = background_depth(gbuffer.layout)
            array.program["light_count"] = len(members)
            self._block.write(records[members])
            self._screen.draw(array)


def _compile(gpu: Gpu, variant: LightingVariant, common: Traits) -> moderngl.Program:
    generated = {
        "generated/planes.glsl": read_source(variant.planes, variant.layout),
        "generated/lights.glsl": lights_source(_MOST, common),
        **shadow_source(variant.shadows),
    }
    defines = [*variant.defines, *variant.distances]
    return gpu.shaders.program("screen.vert", "sky_visibility.frag", defines=defines, generated=generated)
