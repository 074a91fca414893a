"""Rays along lobes: what those of a frame read, the tiles that they are sent from, and the passes that send them."""

from __future__ import annotations

from functools import cache

from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.emitters import middle_of, shadow_extent
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.lighting import LightingVariant
from defshade_cli.passes.lobe_rays import LampRaysPass, LampStore, LobeRays, SkyRaysPass, TreeStore, sky_densities
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.sharp_tiles import SharpTilesPass
from defshade_cli.passes.sky_guide import SkyGuides
from defshade_cli.passes.sky_textures import SkyTextures
from defshade_cli.passes.tables import LightTables
from defshade_cli.plan import Plan
from defshade_cli.scene.scene import Scene


class Lobes:
    """Of one frame after another. sky_pass, lamp_pass: compiled for a variant, and whether geometry hides."""

    def __init__(self, gpu: Gpu, frame: Frame, skies: SkyTextures) -> None:
        self._frame, self._skies, self._sharp = frame, skies, Screen(gpu)
        self._trees, self._lamps = TreeStore(gpu), LampStore(gpu)
        self._sharp_tiles_pass = cache(lambda variant: SharpTilesPass(gpu, variant))
        self.sky_pass = cache(lambda variant, *, hidden: SkyRaysPass(gpu, variant, self._sharp, skies, hidden=hidden))
        self.lamp_pass = cache(lambda variant, *, hidden: LampRaysPass(gpu, variant, self._sharp, hidden=hidden))

    def update(self, scene: Scene, plan: Plan, guides: SkyGuides, tables: LightTables) -> LobeRays | None:
        """What the rays of a plan read, if any are sent."""
        if not plan.lobe_rays:
            return None
        hidden = plan.shadows_lamps or any(plan.shadows_sky(dome) and dome.by_rays for dome in plan.domes)
        lamps = self._lamps.update(plan, middle_of(shadow_extent(scene, plan), plan), tables)
        densities = sky_densities(plan, guides, self._skies)
        return LobeRays(densities, self._trees.update(scene) if hidden else None, lamps)

    def begin(self, plan: Plan, variant: LightingVariant, gbuffer: GBuffer) -> None:
        """Keep to the tiles of a sample's GBuffer from which rays are sent."""
        self._sharp.cover(self._sharp_tiles_pass(variant).regions(plan, gbuffer, self._frame))
