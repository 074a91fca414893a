"""The order of the passes. Local variables are the edges of the graph."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import MOST_TARGETS, Plane
from defshade_cli.gpu.residence import LIGHTS, MOTIONS, VIEW_BLOCK, DrawList, GpuScene, RecordBuffer
from defshade_cli.image.film import Film, Sampling
from defshade_cli.passes.accumulation import AccumulationPass
from defshade_cli.passes.changed_parts import PART, parts_of
from defshade_cli.passes.changed_tiles import beside, changed_tiles, part_around, worthwhile
from defshade_cli.passes.debug_volumes import DebugVolumesPass, laid_over
from defshade_cli.passes.emission import EmissionPass
from defshade_cli.passes.emitters import light_batches, middle_of, shadow_extent
from defshade_cli.passes.environment import EnvironmentPass, EnvironmentVariant
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer, GBufferPass, GBufferVariant
from defshade_cli.passes.identification import Manifests, Mattes, id_manifests
from defshade_cli.passes.last_frame import LastFrame
from defshade_cli.passes.light_lists import TILE
from defshade_cli.passes.light_records import light_records
from defshade_cli.passes.light_targets import LightTargets
from defshade_cli.passes.light_tiles import LightTiles
from defshade_cli.passes.light_whole import WholeLighting
from defshade_cli.passes.lighting import LightingPass, LightingVariant
from defshade_cli.passes.linking import ALL_LINKED
from defshade_cli.passes.lobe_rays import LampRaysPass, LampStore, LobeRays, SkyRaysPass, TreeStore, sky_densities
from defshade_cli.passes.readback import Planes, data_layers, read_planes
from defshade_cli.passes.sampling import CENTRE, Sample, samples
from defshade_cli.passes.screen import Drawn, Narrowing, Screen, TileMask
from defshade_cli.passes.shadow_atlas import ShadowAtlas
from defshade_cli.passes.shadow_maps import MapRequest
from defshade_cli.passes.shadows import ShadowPass, ShadowVariant
from defshade_cli.passes.sharp_tiles import SharpTilesPass
from defshade_cli.passes.sky_guide import NO_GUIDES, SkyGuides, scout, sky_guides
from defshade_cli.passes.sky_textures import SkyTextures
from defshade_cli.passes.sky_visibility import SkyVisibility, SkyVisibilityPass
from defshade_cli.passes.stopping import Stopping
from defshade_cli.passes.tables import LightTables, TableStore
from defshade_cli.passes.view import view_record
from defshade_cli.plan import Plan, ShutterSample
from defshade_cli.scene.emission import far_field
from defshade_cli.scene.scene import Scene

Layers = dict[str, NDArray[np.float32]]


@dataclass(frozen=True, slots=True, eq=False)
class _Known:
    """drawn: what of the image is, None for all of it.  maps: of each batch of lights, those that are drawn already."""

    drawn: Drawn | None
    maps: Sequence[ShadowAtlas]


@dataclass(frozen=True, slots=True, eq=False)
class _Canvas:
    """What the samples of a frame are lit on, what is known of its domes' skies, and what rays along lobes read.

    known: of the frame before.
    """

    gbuffer: GBuffer
    targets: LightTargets
    visibility: SkyVisibility | None
    guides: SkyGuides
    rays: LobeRays | None
    known: _Known


class Pipeline:
    """Renders one frame after another on a Gpu, keeping what they share: buffers, targets, compiled passes.

    lone: there will be one, whose GBuffer is freed before the image is read back.
    """

    def __init__(self, gpu: Gpu, *, lone: bool = False) -> None:
        self._gpu, self._lone = gpu, lone
        gpu.make_current()
        self._scene = GpuScene(gpu)
        self._frame, self._scouted = Frame(gpu), Frame(gpu)
        self._view = RecordBuffer(gpu, VIEW_BLOCK, uniform=True)
        self._lights = RecordBuffer(gpu, LIGHTS)
        self._motions = RecordBuffer(gpu, MOTIONS)
        self._screen, self._sharp, self._mask = Screen(gpu), Screen(gpu), TileMask(gpu)
        self._narrowing = Narrowing(self._screen, self._mask)
        self._skies, self._trees, self._lamps = SkyTextures(gpu), TreeStore(gpu), LampStore(gpu)
        self._gbuffer_pass = cache(lambda variant: GBufferPass(gpu, variant))
        self._emission_pass = cache(lambda variant: EmissionPass(gpu, variant, self._screen))
        self._lighting_pass = cache(lambda variant: LightingPass(gpu, variant, self._screen))
        self._environment_pass = cache(lambda variant: EnvironmentPass(gpu, variant, self._screen, self._skies))
        self._sky_rays_pass = cache(
            lambda variant, hidden: SkyRaysPass(gpu, variant, self._sharp, self._skies, hidden=hidden)
        )
        self._lamp_rays_pass = cache(lambda variant, hidden: LampRaysPass(gpu, variant, self._sharp, hidden=hidden))
        self._sharp_tiles_pass = cache(lambda variant: SharpTilesPass(gpu, variant))
        self._sky_visibility_pass = cache(lambda variant: SkyVisibilityPass(gpu, variant, self._screen))
        self._shadow_pass = cache(lambda variant: ShadowPass(gpu, variant))
        self._light_tiles = LightTiles(gpu, self._frame)
        self._whole_lighting = WholeLighting(gpu, self._screen)
        self._tables = TableStore(gpu)
        self._accumulation = AccumulationPass(gpu, self._frame, self._screen)
        self._debug_volumes_pass = cache(lambda: DebugVolumesPass(gpu))
        self._last = LastFrame(gpu, self._frame)
        self._stopping = Stopping(gpu, self._frame, self._screen, self._narrowing)

    @property
    def largest_side(self) -> int:
        """Pixels a side that the driver can draw at once."""
        return self._gpu.max_size

    def upload(self, scene: Scene, plan: Plan) -> DrawList:
        """The scene on the GPU, when all of it has arrived. Raises GpuError."""
        with self._gpu.watched():
            draws = self._resident(scene, plan)
            self._gpu.context.finish()
        return draws

    def render(
        self,
        scene: Scene,
        plan: Plan,
        moments: Iterator[ShutterSample] | None = None,
        uploaded: DrawList | None = None,
        before: Film | None = None,
    ) -> Film:
        """The plan's layers. Raises GpuError, GpuMemoryError where memory ends.

        moments: what samples see in turn, where the plan has motion blur; data layers show the scene itself.
        uploaded: of this scene, where that has been done before.
        before: the film of the frame that the plan's `redrawing` is about.
        """
        with self._gpu.watched():
            draws = uploaded or self._resident(scene, plan)
            part, maps = self._changes(draws, scene, plan, before) if before else (None, ())
            with self._narrowing.of(part, plan.size):
                film = self._film(draws, scene, plan, moments, _Known(part, maps))
        if before and part:
            layers = beside(before.layers, film.layers, part)
            data = {name: layers[name] for name in plan.data_layers}
            film = replace(film, layers=layers, manifests=film.manifests | id_manifests(data, scene))
        self._last.keep(film)
        return film

    def _changes(
        self, draws: DrawList, scene: Scene, plan: Plan, before: Film
    ) -> tuple[Drawn | None, Sequence[ShadowAtlas]]:
        """What may differ from the frame before, and its shadow maps where those tell it; None for all of the image."""
        tiles, boxes = changed_tiles(plan), plan.redrawing.boxes
        if tiles is None or boxes is None or not plan.redrawing.by_maps:
            return Drawn(tiles, TILE) if tiles is not None else None, ()
        if not self._last.is_of(before):
            return None, ()
        tables, relative = self._tables.update(plan), boxes - plan.camera.position
        batches = enumerate(light_batches(scene, plan, CENTRE) if plan.lit else ())
        requests = [MapRequest.of(batch, plan, CENTRE, tables, number) for number, batch in batches]
        shadow_pass = self._shadow_pass(ShadowVariant.of(draws, plan))
        redrawn = [shadow_pass.redraw(draws, request, relative) for request in requests]
        maps, changes = zip(*filter(None, redrawn), strict=True) if all(redrawn) else ((), ())
        if len(maps) < len(requests):
            return None, ()
        gbuffer = self._frame.gbuffer(plan.size, plan.planes, plan.layout)
        found = [change.all_behind() if plan.shadow_styles else change for each in changes for change in each]
        self._view.write(view_record(plan, gbuffer.layout))
        parts = worthwhile(self._last.shadowed_parts(found, tiles, gbuffer, plan) | parts_of(tiles, plan.size))
        return Drawn(parts, PART, part_around(tiles, plan.size)) if parts is not None else None, maps

    def _film(
        self,
        draws: DrawList,
        scene: Scene,
        plan: Plan,
        moments: Iterator[ShutterSample] | None,
        known: _Known,
    ) -> Film:
        layers: Layers = {}
        manifests: Manifests = {}
        sampling = Sampling(1, 1.0, 1)
        if plan.sampled:
            layers, manifests, sampling = self._sampled_layers(draws, scene, plan, moments, known)
        if plan.data_layers:
            draws = self._resident(scene, plan) if plan.moments else draws
            data = data_layers(self._data_planes(draws, plan), plan, scene)
            layers, manifests = layers | data, manifests | id_manifests(data, scene)
        return Film(
            layers={name: layers[name] for name in plan.layers},
            manifests=manifests,
            camera=plan.display_camera,
            origin=plan.window.origin,
            display=plan.display,
            render_space=plan.render_space,
            scene_name=scene.name,
            frame=scene.frame,
            frames_per_second=scene.frames_per_second,
            samples=sampling.most,
            metadata=sampling.facts if plan.sampled else {},
        )

    def _resident(self, scene: Scene, plan: Plan) -> DrawList:
        """The scene on the GPU, with what the plan's planes read of it."""
        moved: tuple[NDArray[np.float32], ...] = ()
        if "MOTION" in plan.inputs:
            from defshade_cli.passes.motion import motion_records, neighbouring_points

            self._motions.write(motion_records(scene, plan))
            moved = tuple(neighbouring_points(scene))
        return self._scene.update(scene, plan.inputs, moved, plan.primvars, plan.texels, plan.thin, plan.closed)

    def planes(self, scene: Scene, plan: Plan) -> Planes:
        """The float GBuffer at the pixels' centres: what the float64 reference is evaluated on."""
        self._gpu.make_current()
        self._last.forget()
        return self._drawn_planes(self._scene.update(scene, texels=plan.texels, thin=plan.thin), plan.planes, plan)

    def _sampled_layers(
        self,
        draws: DrawList,
        scene: Scene,
        plan: Plan,
        moments: Iterator[ShutterSample] | None,
        known: _Known,
    ) -> tuple[Layers, Manifests, Sampling]:
        """What is a mean over samples or tells of them, and what ids in it stand for."""
        mattes = Mattes(scene, plan)
        guides = self._guides(draws, plan)
        gbuffer = self._frame.gbuffer(plan.size, plan.planes, plan.layout)
        radiance = self._frame.radiance("sample", plan.size, gbuffer)
        targets = self._frame.light_targets(radiance, plan)
        targets.clear()
        hidden = any(plan.hides_sky(dome) for dome in plan.domes)
        visibility = SkyVisibility.of(self._frame, plan.size) if hidden else None
        tables = self._tables.update(plan)
        canvas = _Canvas(gbuffer, targets, visibility, guides, self._lobe_rays(scene, plan, guides, tables), known)
        self._accumulation.begin(plan.size, plan.samples)
        self._stopping.begin(plan)
        for sample in samples(plan.samples, plan.filter, plan.filter_width, may_stop=plan.tracks_error):
            if moments and plan.moments and sample.index % plan.samples_a_moment == 0:
                scene, plan = next(moments)
                draws = self._scene.update(scene, plan.inputs, texels=plan.texels, thin=plan.thin, closed=plan.closed)
                tables = self._tables.update(plan)
                mattes.see(scene)
                if canvas.rays:
                    canvas.rays.release()
                canvas = replace(canvas, rays=self._lobe_rays(scene, plan, guides, tables))
            self._draw_gbuffer(draws, plan, gbuffer, sample)
            if plan.mattes:
                mattes.add(gbuffer.target.read("visible"))
            self._light(draws, scene, plan, sample, tables, canvas)
            self._accumulation.add(radiance)
            if self._stopping.is_over(self._accumulation):
                break
        sampling, counts, variance = self._stopping.finish(self._accumulation.count)
        if canvas.rays:
            canvas.rays.release()
        if self._lone and not (plan.data_layers or plan.debug):
            self._frame.spare(gbuffer)
            self._mask.let_go_of_textures(radiance)
        beauty = self._accumulation.mean(counts)
        if plan.debug == "volumes":
            beauty = laid_over(beauty, self._volumes(draws, plan, tables, gbuffer))
        layers = {"beauty": beauty, "alpha": beauty[..., 3:]} | targets.layers(counts)
        if {"variance", "sampleCount"} & set(plan.layers):
            layers |= {"variance": variance, "sampleCount": counts.astype(np.float32)}
        return layers | mattes.layers(self._accumulation.count), mattes.manifests(), sampling

    def _light(
        self,
        draws: DrawList,
        scene: Scene,
        plan: Plan,
        sample: Sample,
        tables: LightTables,
        canvas: _Canvas,
    ) -> None:
        """One sample of every light: as many at a time as the shadow atlas holds; then the skies, seen as they let."""
        gbuffer, targets, visibility = canvas.gbuffer, canvas.targets, canvas.visibility
        variant = LightingVariant.of(plan)
        self._emission_pass(variant).draw(gbuffer, targets)
        if plan.lighting == "tiles":
            self._light_tiles.begin(gbuffer, plan, sample, canvas.known.drawn)
        openness = self._sky_visibility_pass(variant) if visibility else None
        if openness and visibility:
            openness.begin_sample(visibility)
        batches = light_batches(scene, plan, sample, canvas.guides) if plan.lit else ()
        for number, batch in enumerate(batches):
            shadows = None
            if plan.shadows:
                known = canvas.known.maps[number] if canvas.known.maps else None
                request = MapRequest.of(batch, plan, sample, tables, 0 if self._lone else number)
                shadows = self._shadow_maps(draws, plan, request, known)
            lights, emitters = [lit.planned for lit in batch], [lit.emitter for lit in batch]
            records = light_records(lights, emitters, plan.camera.position, shadows, tables)
            self._lights.write(records)
            if plan.lighting == "whole":
                self._whole_lighting.add(lights, records, plan, gbuffer, targets, shadows, tables)
            elif plan.lighting == "tiles":
                self._light_tiles.add(lights, records, gbuffer, targets, shadows, tables)
            else:
                self._lighting_pass(variant).add(lights, gbuffer, targets, shadows, tables)
            if openness and visibility and shadows:
                openness.add(lights, plan, gbuffer, visibility, shadows)
        if canvas.rays:
            self._sharp.cover(self._sharp_tiles_pass(variant).regions(plan, gbuffer, self._frame))
        for dome in plan.domes:
            environment = self._environment_pass(EnvironmentVariant.of(plan, dome))
            first_link = tables.links.lights.get(dome.light, ALL_LINKED)
            environment.draw(dome, gbuffer, targets, visibility, first_link)
            if canvas.rays and dome.by_rays:
                lobes = self._sky_rays_pass(variant, plan.shadows_sky(dome))
                lobes.draw(dome, plan, gbuffer, targets, canvas.rays, first_link)
        if canvas.rays and plan.lamps:
            self._lights.write(canvas.rays.lamps)
            lamps = self._lamp_rays_pass(LightingVariant.of(plan, plan.lamps), plan.shadows_lamps)
            lamps.draw(plan, gbuffer, targets, canvas.rays, tables)

    def _lobe_rays(self, scene: Scene, plan: Plan, guides: SkyGuides, tables: LightTables) -> LobeRays | None:
        """What rays along lobes need, if any are sent."""
        if not plan.lobe_rays:
            return None
        hidden = plan.shadows_lamps or any(plan.shadows_sky(dome) and dome.by_rays for dome in plan.domes)
        extent = shadow_extent(scene, plan)
        lamps = self._lamps.update(plan, middle_of(extent, plan), tables)
        densities = sky_densities(plan, guides, self._skies)
        return LobeRays(densities, self._trees.update(scene) if hidden else None, lamps)

    def _guides(self, draws: DrawList, plan: Plan) -> SkyGuides:
        """Where in its domes' skies the image looks for light, if samples are drawn there."""
        if not (plan.lit and any(dome.points for dome in plan.domes)):
            return NO_GUIDES
        small = scout(plan)
        return sky_guides(self._drawn_planes(draws, plan.planes, small, self._scouted), small)

    def _volumes(self, draws: DrawList, plan: Plan, tables: LightTables, gbuffer: GBuffer) -> NDArray[np.float32]:
        """The light volumes as the pixels' centres see them, domes apart."""
        self._draw_gbuffer(draws, plan, gbuffer, CENTRE)
        lights = [planned for planned in plan.lights if planned not in plan.domes]
        emitters = [far_field(planned.light) for planned in lights]
        self._lights.write(light_records(lights, emitters, plan.camera.position, None, tables))
        target = self._frame.radiance("debug", plan.size, gbuffer)
        return self._debug_volumes_pass().draw(lights, target, gbuffer.layout)

    def _shadow_maps(self, draws: DrawList, plan: Plan, request: MapRequest, known: ShadowAtlas | None) -> ShadowAtlas:
        shadow_pass = self._shadow_pass(ShadowVariant.of(draws, plan))
        atlas = known or shadow_pass.draw(draws, request)
        shadow_pass.show(atlas)
        return atlas

    def _data_planes(self, draws: DrawList, plan: Plan) -> Planes:
        """Planes for the data layers: the beauty's own where it drew them in float at the pixels' centres.

        Else as many at a time as a framebuffer takes.
        """
        if not plan.data_pass:
            return read_planes(self._frame.gbuffer(plan.size, plan.planes, plan.layout), plan.data_planes, plan)
        planes: Planes = {}
        for first in range(0, max(len(plan.data_planes), 1), MOST_TARGETS):
            planes |= self._drawn_planes(draws, plan.data_planes[first : first + MOST_TARGETS], plan)
        return planes

    def _drawn_planes(
        self, draws: DrawList, planes: tuple[Plane, ...], plan: Plan, frame: Frame | None = None
    ) -> Planes:
        gbuffer = (frame or self._frame).gbuffer(plan.size, planes, "float")
        self._draw_gbuffer(draws, plan, gbuffer, CENTRE)
        return read_planes(gbuffer, planes, plan)

    def _draw_gbuffer(self, draws: DrawList, plan: Plan, gbuffer: GBuffer, sample: Sample) -> None:
        view = view_record(plan, gbuffer.layout, sample)
        self._view.write(view)
        variant = GBufferVariant(
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
        self._gbuffer_pass(variant).draw(
            draws, gbuffer, self._mask, plan.camera, view["clip_from_relative"][0], whole=bool(plan.mattes)
        )
