"""One sample of all light: what shines by itself, light after light, the skies, and what lobes mirror."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from itertools import count
from typing import Any

from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.buffers import LIGHTS, RecordBuffer
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.draw_list import DrawList
from defshade_cli.passes.emission import EmissionPass
from defshade_cli.passes.emitters import LitSample, light_batches
from defshade_cli.passes.environment import EnvironmentPass, EnvironmentVariant
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.last_frame import Known
from defshade_cli.passes.light_records import light_records
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.passes.light_tiles import LightTiles
from defshade_cli.passes.light_whole import WholeLighting
from defshade_cli.passes.lighting import LightingPass, LightingVariant
from defshade_cli.passes.linking import ALL_LINKED
from defshade_cli.passes.lobe_rays import LobeRays
from defshade_cli.passes.lobes import Lobes
from defshade_cli.passes.sampling import Sample
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.shadow_atlas import ShadowAtlas
from defshade_cli.passes.shadow_maps import MapRequest
from defshade_cli.passes.shadows import ShadowPass, ShadowVariant
from defshade_cli.passes.shared_shadows import SharedShadows, apart_from, shared_runs
from defshade_cli.passes.sky_guide import SkyGuides
from defshade_cli.passes.sky_textures import SkyTextures
from defshade_cli.passes.sky_visibility import SkyVisibility, SkyVisibilityPass
from defshade_cli.passes.tables import LightTables, TableStore
from defshade_cli.plan import Plan, PlannedLight
from defshade_cli.scene.scene import Scene


@dataclass(frozen=True, slots=True, eq=False)
class LitScene:
    """What samples see at one time of the shutter, and what its lighting reads.

    variant: for all of its lights.  rays: those along lobes, if any are sent.
    """

    scene: Scene
    plan: Plan
    draws: DrawList
    variant: LightingVariant
    tables: LightTables
    rays: LobeRays | None

    def release(self) -> None:
        """What the next one does not keep."""
        if self.rays:
            self.rays.release()


@dataclass(frozen=True, slots=True, eq=False)
class Canvas:
    """What all samples of a frame are lit on, what is known of its domes' skies, and of the frame before."""

    gbuffer: GBuffer
    targets: LightTargets
    visibility: SkyVisibility | None
    guides: SkyGuides
    known: Known


class SampleLighting:
    """Of one frame after another. lone: there will be one, whose shadow maps nothing keeps."""

    def __init__(
        self,
        gpu: Gpu,
        frame: Frame,
        screen: Screen,
        tables: TableStore,
        shadow_pass: Callable[[ShadowVariant], ShadowPass],
        *,
        lone: bool,
    ) -> None:
        skies = SkyTextures(gpu)
        self._tables, self._shadow_pass, self._lone = tables, shadow_pass, lone
        self._records = RecordBuffer(gpu, LIGHTS)
        self._emission_pass = cache(lambda variant: EmissionPass(gpu, variant, screen))
        self._volumes_pass = cache(lambda variant: LightingPass(gpu, variant, screen))
        self._tiles, self._whole = LightTiles(gpu, frame), WholeLighting(gpu, screen)
        self._shared = SharedShadows(gpu, frame)
        self._openness = SkyVisibilityPass(gpu, screen)
        self._environment_pass = cache(lambda variant: EnvironmentPass(gpu, variant, screen, skies))
        self._lobes = Lobes(gpu, frame, skies)

    def prepare(self, scene: Scene, plan: Plan, draws: DrawList, guides: SkyGuides) -> LitScene:
        """Make what lighting reads of a plan resident."""
        tables = self._tables.update(plan)
        rays = self._lobes.update(scene, plan, guides, tables)
        return LitScene(scene, plan, draws, LightingVariant.of(plan), tables, rays)

    def draw(self, lit: LitScene, sample: Sample, canvas: Canvas) -> None:
        """In place of the radiance that the canvas holds, on top of its sums. The sample is in its GBuffer."""
        self._emission_pass(lit.variant).draw(canvas.gbuffer, canvas.targets)
        self._add_lights(lit, sample, canvas)
        if lit.rays:
            self._lobes.begin(lit.plan, lit.variant, canvas.gbuffer)
        self._add_skies(lit, canvas)
        if lit.rays and lit.plan.lamps:
            self._records.write(lit.rays.lamps)
            lamp_pass = self._lobes.lamp_pass(
                LightingVariant.of(lit.plan, lit.plan.lamps), hidden=lit.plan.shadows_lamps
            )
            lamp_pass.draw(lit.plan, canvas.gbuffer, canvas.targets, lit.rays, lit.tables)

    def _add_lights(self, lit: LitScene, sample: Sample, canvas: Canvas) -> None:
        """As many at a time as the shadow atlas holds; domes' points tell what the sky leaves open."""
        plan, visibility = lit.plan, canvas.visibility
        if plan.lighting == "tiles":
            self._tiles.begin(canvas.gbuffer, plan, sample, canvas.known.drawn)
        if visibility:
            self._openness.begin_sample(visibility)
        turns = count(sample.index + 1)
        batches = light_batches(lit.scene, plan, sample, canvas.guides) if plan.lit else ()
        for number, batch in enumerate(batches):
            shadows = self._shadows(lit, sample, batch, number, canvas.known) if plan.shadows else None
            lights, emitters = [each.planned for each in batch], [each.emitter for each in batch]
            records = light_records(lights, emitters, plan.camera.position, shadows, lit.tables)
            runs = shared_runs(lights, plan) if shadows else []
            own = apart_from(len(lights), runs)
            self._add_apart(lit, [lights[n] for n in own], records[own], canvas, shadows and shadows.part(own))
            if visibility and shadows:
                self._openness.add(lights, records, plan, canvas.gbuffer, visibility, shadows)
            for run in runs:
                assert shadows
                self._add_shared(lit, lights[run], records[run], canvas, shadows.part(run), next(turns))

    def _shadows(
        self, lit: LitScene, sample: Sample, batch: Sequence[LitSample], number: int, known: Known
    ) -> ShadowAtlas:
        """The maps of the number-th batch, drawn unless they are known."""
        shadow_pass = self._shadow_pass(ShadowVariant.of(lit.draws, lit.plan))
        request = MapRequest.of(batch, lit.plan, sample, lit.tables, 0 if self._lone else number)
        atlas = known.maps[number] if known.maps else shadow_pass.draw(lit.draws, request)
        shadow_pass.show(atlas)
        return atlas

    def _add_apart(
        self,
        lit: LitScene,
        lights: Sequence[PlannedLight],
        records: NDArray[Any],
        canvas: Canvas,
        shadows: ShadowAtlas | None,
    ) -> None:
        """Lights whose shadows each pixel looks up by itself."""
        if not len(records):
            return
        self._records.write(records)
        gbuffer, targets = canvas.gbuffer, canvas.targets
        if lit.plan.lighting == "whole":
            self._whole.add(lights, records, lit.plan, gbuffer, targets, shadows, lit.tables)
        elif lit.plan.lighting == "tiles":
            self._tiles.add(lights, records, gbuffer, targets, shadows, lit.tables)
        else:
            self._volumes_pass(lit.variant).add(lights, gbuffer, targets, shadows, lit.tables)

    def _add_shared(
        self,
        lit: LitScene,
        lights: Sequence[PlannedLight],
        records: NDArray[Any],
        canvas: Canvas,
        shadows: ShadowAtlas,
        turn: int,
    ) -> None:
        """Directions of a dome whose shadows pixels tell each other. turn: of the pixels that look them up."""
        seen = self._shared.see(lit.variant, lit.plan, canvas.gbuffer, shadows, turn)
        self._whole.add(lights, records, lit.plan, canvas.gbuffer, canvas.targets, None, lit.tables, seen)

    def _add_skies(self, lit: LitScene, canvas: Canvas) -> None:
        """Behind the geometry and in lobes, as far as it leaves them open."""
        for dome in lit.plan.domes:
            first_link = lit.tables.links.lights.get(dome.light, ALL_LINKED)
            environment_pass = self._environment_pass(EnvironmentVariant.of(lit.plan, dome))
            environment_pass.draw(dome, canvas.gbuffer, canvas.targets, canvas.visibility, first_link)
            if lit.rays and dome.by_rays:
                sky_pass = self._lobes.sky_pass(lit.variant, hidden=lit.plan.shadows_sky(dome))
                sky_pass.draw(dome, lit.plan, canvas.gbuffer, canvas.targets, lit.rays, first_link)
