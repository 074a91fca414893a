"""The order of the passes in a frame. Local variables are the edges of the graph.

geometry → what changed since the last frame → samples: GBuffer → light → sum → layers, beside data layers → Film
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.draw_list import DrawList
from defshade_cli.image.film import Film, Sampling
from defshade_cli.passes.accumulation import AccumulationPass
from defshade_cli.passes.changed_tiles import Layers, beside
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.geometry import Geometry
from defshade_cli.passes.identification import Manifests, id_manifests
from defshade_cli.passes.last_frame import NOTHING_KNOWN, Known, LastFrame
from defshade_cli.passes.readback import Planes, data_layers
from defshade_cli.passes.sample_lighting import SampleLighting
from defshade_cli.passes.sampler import Sampler
from defshade_cli.passes.screen import Drawn, Narrowing, Screen, TileMask
from defshade_cli.passes.shadows import ShadowPass
from defshade_cli.passes.stopping import Stopping
from defshade_cli.passes.tables import TableStore
from defshade_cli.plan import Plan, ShutterSample
from defshade_cli.scene.scene import Scene


class Pipeline:
    """Renders one frame after another on a Gpu, keeping what they share: buffers, targets, compiled passes.

    lone: there will be one, whose GBuffer is freed before the image is read back.
    """

    def __init__(self, gpu: Gpu, *, lone: bool = False) -> None:
        gpu.make_current()
        self._gpu, self._frame = gpu, Frame(gpu)
        screen, mask = Screen(gpu), TileMask(gpu)
        self._narrowing = Narrowing(screen, mask)
        tables, shadow_pass = TableStore(gpu), cache(lambda variant: ShadowPass(gpu, variant))
        self._geometry = Geometry(gpu, mask)
        self._last = LastFrame(gpu, self._frame, self._geometry, tables, shadow_pass)
        lighting = SampleLighting(gpu, self._frame, screen, tables, shadow_pass, lone=lone)
        accumulation = AccumulationPass(gpu, self._frame, screen)
        stopping = Stopping(gpu, self._frame, screen, self._narrowing)
        self._sampler = Sampler(gpu, self._frame, self._geometry, lighting, accumulation, stopping, mask, lone=lone)

    @property
    def largest_side(self) -> int:
        """Pixels a side that the driver can draw at once."""
        return self._gpu.max_size

    def upload(self, scene: Scene, plan: Plan) -> DrawList:
        """The scene on the GPU, when all of it has arrived. Raises GpuError."""
        with self._gpu.watched():
            draws = self._geometry.update(scene, plan)
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
            draws = uploaded or self._geometry.update(scene, plan)
            known = self._last.compare(before, draws, scene, plan) if before else NOTHING_KNOWN
            with self._narrowing.of(known.drawn, plan.size):
                film = self._film(draws, scene, plan, moments, known)
        if before and known.drawn:
            film = _completed(film, before, known.drawn, scene, plan)
        self._last.keep(film)
        return film

    def _film(
        self, draws: DrawList, scene: Scene, plan: Plan, moments: Iterator[ShutterSample] | None, known: Known
    ) -> Film:
        layers: Layers = {}
        manifests: Manifests = {}
        sampling = Sampling(1, 1.0, 1)
        if plan.sampled:
            layers, manifests, sampling = self._sampler.layers(draws, scene, plan, moments, known)
        if plan.data_layers:
            draws = self._geometry.update(scene, plan) if plan.moments else draws
            data = data_layers(self._geometry.data_planes(draws, plan, self._frame), plan, scene)
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

    def planes(self, scene: Scene, plan: Plan) -> Planes:
        """The float GBuffer at the pixels' centres: what the float64 reference is evaluated on."""
        self._gpu.make_current()
        self._last.forget()
        return self._geometry.planes(self._geometry.update(scene, plan), plan.planes, plan, self._frame)


def _completed(film: Film, before: Film, drawn: Drawn, scene: Scene, plan: Plan) -> Film:
    """What is drawn, beside what the frame before leaves of the image."""
    layers = beside(before.layers, film.layers, drawn)
    data = {name: layers[name] for name in plan.data_layers}
    return replace(film, layers=layers, manifests=film.manifests | id_manifests(data, scene))
