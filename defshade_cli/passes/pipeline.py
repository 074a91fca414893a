"""The order of the passes. Local variables are the edges of the graph."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.residence import LIGHTS, VIEW, DrawList, GpuScene, RecordBuffer
from defshade_cli.gpu.targets import Target
from defshade_cli.image.film import Film, Sampling
from defshade_cli.passes.accumulation import AccumulationPass
from defshade_cli.passes.emitters import light_batches
from defshade_cli.passes.environment import EnvironmentPass, EnvironmentVariant
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer, GBufferPass, GBufferVariant
from defshade_cli.passes.lighting import LightingPass, LightingVariant, light_records
from defshade_cli.passes.readback import Planes, data_layers, read_planes
from defshade_cli.passes.sampling import CENTRE, Sample, samples
from defshade_cli.passes.screen import Screen, TileMask
from defshade_cli.passes.shadows import ShadowPass
from defshade_cli.passes.stopping import Stopping
from defshade_cli.passes.view import view_record
from defshade_cli.plan import Plan
from defshade_cli.scene.scene import Scene

Layers = dict[str, NDArray[np.float32]]


class Pipeline:
    """Renders one frame after another on a Gpu, keeping what they share: buffers, targets, compiled passes."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        gpu.make_current()
        self._scene = GpuScene(gpu)
        self._frame = Frame(gpu)
        self._view = RecordBuffer(gpu, VIEW)
        self._lights = RecordBuffer(gpu, LIGHTS)
        self._screen, self._mask = Screen(gpu), TileMask(gpu)
        self._gbuffer_pass = cache(lambda variant: GBufferPass(gpu, variant))
        self._lighting_pass = cache(lambda variant: LightingPass(gpu, variant, self._screen))
        self._environment_pass = cache(lambda variant: EnvironmentPass(gpu, variant, self._screen))
        self._shadow_pass = cache(
            lambda cutout, color_varies, texture_groups: ShadowPass(
                gpu, cutout=cutout, color_varies=color_varies, texture_groups=texture_groups
            )
        )
        self._accumulation = AccumulationPass(gpu, self._frame, self._screen)
        self._stopping = Stopping(gpu, self._frame, self._screen, self._mask)

    def render(self, scene: Scene, plan: Plan) -> Film:
        """The plan's layers. Raises GpuError."""
        self._gpu.make_current()
        draws = self._scene.update(scene)
        layers: Layers = {}
        sampling = Sampling(1, 1.0, 1)
        if plan.lit:
            layers, sampling = self._sampled_layers(draws, scene, plan)
        if not layers.keys() >= set(plan.layers):
            layers |= data_layers(self._data_planes(draws, plan), plan)
        return Film(
            layers={name: layers[name] for name in plan.layers},
            camera=plan.camera,
            scene_name=scene.name,
            frame=scene.frame,
            frames_per_second=scene.frames_per_second,
            samples=sampling.most,
            metadata=sampling.facts if plan.lit else {},
        )

    def planes(self, scene: Scene, plan: Plan) -> Planes:
        """The float GBuffer at the pixels' centres: what the float64 reference is evaluated on."""
        self._gpu.make_current()
        return self._drawn_planes(self._scene.update(scene), plan)

    def _sampled_layers(self, draws: DrawList, scene: Scene, plan: Plan) -> tuple[Layers, Sampling]:
        """What is a mean over samples, or tells of them."""
        gbuffer = self._frame.gbuffer(plan.size, plan.planes, plan.layout)
        radiance = self._frame.radiance("sample", plan.size, gbuffer)
        self._accumulation.begin(plan.size, plan.samples)
        self._stopping.begin(plan)
        for sample in samples(plan.samples, plan.filter, plan.filter_width):
            self._draw_gbuffer(draws, plan, gbuffer, sample)
            self._light(draws, scene, plan, sample, gbuffer, radiance)
            self._accumulation.add(radiance)
            if self._stopping.is_over(self._accumulation):
                break
        sampling, counts, variance = self._stopping.finish(self._accumulation.count)
        beauty = self._accumulation.mean(counts)
        return {"beauty": beauty, "variance": variance, "sampleCount": counts.astype(np.float32)}, sampling

    def _light(
        self, draws: DrawList, scene: Scene, plan: Plan, sample: Sample, gbuffer: GBuffer, radiance: Target
    ) -> None:
        """One sample of every light: as many at a time as the shadow atlas holds."""
        lighting = self._lighting_pass(LightingVariant.of(plan))
        lighting.begin(gbuffer, radiance)
        for dome in plan.domes:
            self._environment_pass(EnvironmentVariant.of(plan)).draw(dome, gbuffer, radiance)
        for batch in light_batches(scene, plan, sample):
            shadows = None
            if plan.shadows:
                shadow_pass = self._shadow_pass(plan.cutout, draws.color_varies, draws.texture_groups)
                shadows = shadow_pass.draw(draws, [lit.shadow_cameras for lit in batch], sample.texel_offset)
            lights, emitters = [lit.planned for lit in batch], [lit.emitter for lit in batch]
            self._lights.write(light_records(lights, emitters, plan.camera.position, shadows))
            lighting.add(lights, gbuffer, radiance, shadows)

    def _data_planes(self, draws: DrawList, plan: Plan) -> Planes:
        """Planes for the data layers: the beauty's own where it drew them in float at the pixels' centres."""
        if plan.lit and not plan.data_pass:
            return read_planes(self._frame.gbuffer(plan.size, plan.planes, plan.layout), plan)
        return self._drawn_planes(draws, plan)

    def _drawn_planes(self, draws: DrawList, plan: Plan) -> Planes:
        gbuffer = self._frame.gbuffer(plan.size, plan.planes, "float")
        self._draw_gbuffer(draws, plan, gbuffer, CENTRE)
        return read_planes(gbuffer, plan)

    def _draw_gbuffer(self, draws: DrawList, plan: Plan, gbuffer: GBuffer, sample: Sample) -> None:
        self._view.write(view_record(plan, gbuffer.layout, sample))
        variant = GBufferVariant(gbuffer.planes, gbuffer.layout, plan.cutout, draws.color_varies, draws.texture_groups)
        self._gbuffer_pass(variant).draw(draws, gbuffer, self._mask)
