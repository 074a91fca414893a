"""The samples of a frame: drawn and lit one after another, summed, and read back once they are enough."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.draw_list import DrawList
from defshade_cli.image.film import Sampling
from defshade_cli.passes.accumulation import AccumulationPass
from defshade_cli.passes.changed_tiles import Layers
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.geometry import Geometry
from defshade_cli.passes.identification import Manifests, Mattes
from defshade_cli.passes.last_frame import Known
from defshade_cli.passes.sample_lighting import Canvas, LitScene, SampleLighting
from defshade_cli.passes.sampling import CENTRE, Sample, samples
from defshade_cli.passes.screen import TileMask
from defshade_cli.passes.sky_guide import NO_GUIDES, SkyGuides, scout, sky_guides
from defshade_cli.passes.sky_visibility import SkyVisibility
from defshade_cli.passes.stopping import Stopping
from defshade_cli.plan import Plan, ShutterSample
from defshade_cli.scene.scene import Scene

if TYPE_CHECKING:
    from defshade_cli.passes.debug_volumes import DebugVolumesPass


class Sampler:
    """Of one frame after another. lone: there will be one, whose GBuffer is freed before the image is read back."""

    def __init__(
        self,
        gpu: Gpu,
        frame: Frame,
        geometry: Geometry,
        lighting: SampleLighting,
        accumulation: AccumulationPass,
        stopping: Stopping,
        mask: TileMask,
        *,
        lone: bool,
    ) -> None:
        self._gpu, self._frame, self._scouted = gpu, frame, Frame(gpu)
        self._geometry, self._lighting = geometry, lighting
        self._accumulation, self._stopping = accumulation, stopping
        self._mask, self._lone = mask, lone

    def layers(
        self, draws: DrawList, scene: Scene, plan: Plan, moments: Iterator[ShutterSample] | None, known: Known
    ) -> tuple[Layers, Manifests, Sampling]:
        """What is a mean over samples or tells of them, and what ids in it stand for. Raises GpuError.

        moments: as Pipeline.render has them.
        """
        mattes, canvas = Mattes(scene, plan), self._canvas(draws, plan, known)
        lit = self._lighting.prepare(scene, plan, draws, canvas.guides)
        self._accumulation.begin(plan.size, plan.samples)
        self._stopping.begin(plan)
        for sample in samples(plan.samples, plan.filter, plan.filter_width, may_stop=plan.tracks_error):
            if moments and plan.moments and sample.index % plan.samples_a_moment == 0:
                lit.release()
                lit = self._at_moment(*next(moments), canvas.guides)
                mattes.see(lit.scene)
            self._add(sample, lit, canvas, mattes)
            if self._stopping.is_over(self._accumulation):
                break
        lit.release()
        sampling, counts, variance = self._stopping.finish(self._accumulation.count)
        layers = self._read(lit, canvas, counts)
        if {"variance", "sampleCount"} & set(plan.layers):
            layers |= {"variance": variance, "sampleCount": counts.astype(np.float32)}
        return layers | mattes.layers(self._accumulation.count), mattes.manifests(), sampling

    def _canvas(self, draws: DrawList, plan: Plan, known: Known) -> Canvas:
        """Without any light yet."""
        guides = self._guides(draws, plan)
        gbuffer = self._frame.gbuffer(plan.size, plan.planes, plan.layout)
        targets = self._frame.light_targets(self._frame.radiance("sample", plan.size, gbuffer), plan)
        targets.clear()
        hidden = any(plan.hides_sky(dome) for dome in plan.domes)
        visibility = SkyVisibility.of(self._frame, plan.size, gbuffer) if hidden else None
        return Canvas(gbuffer, targets, visibility, guides, known)

    def _guides(self, draws: DrawList, plan: Plan) -> SkyGuides:
        """Where in its domes' skies the image looks for light, if samples are drawn there."""
        if not (plan.lit and any(dome.points for dome in plan.domes)):
            return NO_GUIDES
        small = scout(plan)
        return sky_guides(self._geometry.planes(draws, plan.planes, small, self._scouted), small)

    def _at_moment(self, scene: Scene, plan: Plan, guides: SkyGuides) -> LitScene:
        return self._lighting.prepare(scene, plan, self._geometry.update_to_moment(scene, plan), guides)

    def _add(self, sample: Sample, lit: LitScene, canvas: Canvas, mattes: Mattes) -> None:
        self._geometry.draw(lit.draws, lit.plan, canvas.gbuffer, sample)
        if lit.plan.mattes:
            mattes.add(canvas.gbuffer.target.read("visible"))
        self._lighting.draw(lit, sample, canvas)
        self._accumulation.add(canvas.targets.radiance)

    def _read(self, lit: LitScene, canvas: Canvas, counts: NDArray[np.int32]) -> Layers:
        """Means over samples. counts: (height, width, 1) that each pixel got."""
        if self._lone and not (lit.plan.data_layers or lit.plan.debug):
            self._frame.spare(canvas.gbuffer)
            self._mask.let_go_of_textures(canvas.targets.radiance)
        beauty = self._accumulation.mean(counts)
        if lit.plan.debug == "volumes":
            beauty = self._with_volumes(beauty, lit, canvas)
        return {"beauty": beauty, "alpha": beauty[..., 3:]} | canvas.targets.layers(counts)

    def _with_volumes(self, beauty: NDArray[np.float32], lit: LitScene, canvas: Canvas) -> NDArray[np.float32]:
        """The light volumes as the pixels' centres see them, laid over an image (H, W, 4)."""
        from defshade_cli.passes.debug_volumes import laid_over

        self._geometry.draw(lit.draws, lit.plan, canvas.gbuffer, CENTRE)
        target = self._frame.radiance("debug", lit.plan.size, canvas.gbuffer)
        return laid_over(beauty, self._volumes_pass.draw(lit.plan, lit.tables, target, canvas.gbuffer.layout))

    @cached_property
    def _volumes_pass(self) -> DebugVolumesPass:
        from defshade_cli.passes.debug_volumes import DebugVolumesPass

        return DebugVolumesPass(self._gpu)
