"""The scene's geometry: resident on the device, and drawn into GBuffers."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.buffers import MOTIONS, VIEW_BLOCK, RecordBuffer
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.draw_list import DrawList
from defshade_cli.gpu.planes import MOST_TARGETS, Plane
from defshade_cli.gpu.residence import GpuScene
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer, GBufferPass, GBufferVariant
from defshade_cli.passes.readback import Planes, read_planes
from defshade_cli.passes.sampling import CENTRE, Sample
from defshade_cli.passes.screen import TileMask
from defshade_cli.passes.view import view_record
from defshade_cli.plan import Plan
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import Layout


class Geometry:
    """Of one scene after another. mask: what draws keep to."""

    def __init__(self, gpu: Gpu, mask: TileMask) -> None:
        self._scene, self._mask = GpuScene(gpu), mask
        self._view = RecordBuffer(gpu, VIEW_BLOCK, uniform=True)
        self._motions = RecordBuffer(gpu, MOTIONS)
        self._pass = cache(lambda variant: GBufferPass(gpu, variant))

    def update(self, scene: Scene, plan: Plan) -> DrawList:
        """Make it resident, with what the plan's planes read of it."""
        moved: tuple[NDArray[np.float32], ...] = ()
        if "MOTION" in plan.inputs:
            from defshade_cli.passes.motion import motion_records, neighbouring_points

            self._motions.write(motion_records(scene, plan))
            moved = tuple(neighbouring_points(scene))
        return self._update(scene, plan, moved, plan.primvars)

    def update_to_moment(self, scene: Scene, plan: Plan) -> DrawList:
        """The same at another time of the shutter, which data layers do not show."""
        return self._update(scene, plan)

    def _update(
        self, scene: Scene, plan: Plan, moved: tuple[NDArray[np.float32], ...] = (), primvars: tuple[str, ...] = ()
    ) -> DrawList:
        chosen = {"thin": plan.thin, "closed": plan.closed, "coarse": plan.coarse}
        return self._scene.update(scene, plan.inputs, moved, primvars, plan.texels, **chosen)

    def look(self, plan: Plan, layout: Layout, sample: Sample = CENTRE) -> NDArray[Any]:
        """Bind the View (1,) of a sample, and return it."""
        view = view_record(plan, layout, sample)
        self._view.write(view)
        return view

    def draw(self, draws: DrawList, plan: Plan, gbuffer: GBuffer, sample: Sample) -> None:
        """Fill the planes with what a sample sees."""
        clip_from_relative = self.look(plan, gbuffer.layout, sample)["clip_from_relative"][0]
        gbuffer_pass = self._pass(GBufferVariant.of(draws, plan, gbuffer))
        gbuffer_pass.draw(draws, gbuffer, self._mask, plan.camera, clip_from_relative, whole=bool(plan.mattes))

    def planes(self, draws: DrawList, planes: tuple[Plane, ...], plan: Plan, frame: Frame) -> Planes:
        """Drawn in float at the pixels' centres. Raises GpuError."""
        gbuffer = frame.gbuffer(plan.size, planes, "float")
        self.draw(draws, plan, gbuffer, CENTRE)
        return read_planes(gbuffer, planes, plan)

    def data_planes(self, draws: DrawList, plan: Plan, frame: Frame) -> Planes:
        """Planes for the data layers: the beauty's own where it drew them in float at the pixels' centres.

        Else as many at a time as a framebuffer takes. Raises GpuError.
        """
        if not plan.data_pass:
            return read_planes(frame.gbuffer(plan.size, plan.planes, plan.layout), plan.data_planes, plan)
        planes: Planes = {}
        for first in range(0, max(len(plan.data_planes), 1), MOST_TARGETS):
            planes |= self.planes(draws, plan.data_planes[first : first + MOST_TARGETS], plan, frame)
        return planes
