"""What lights are drawn into: the radiance of a sample, and sums over all samples that some layers show."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.targets import Target, allocate, free
from defshade_cli.plan import Plan

Groups = tuple[str, ...]


class LightTargets:
    """radiance: of one sample.  sums: layer → what it has over all samples, blended straight into.

    Raises GpuError.
    """

    def __init__(self, gpu: Gpu, radiance: Target, plan: Plan) -> None:
        self.radiance = radiance
        self.sums = {name: allocate(gpu, plan.size, {"sum": (4, "f4")}) for name in (*plan.outputs, *plan.groups)}
        self._context, self._outputs = gpu.context, plan.outputs
        self._framebuffers: dict[Groups, moderngl.Framebuffer] = {}

    def of(self, groups: Groups) -> moderngl.Framebuffer:
        """For lights of a set of groups: the radiance, the outputs that every light has, and the groups."""
        names = (*self._outputs, *groups)
        if not names:
            return self.radiance.framebuffer
        if names not in self._framebuffers:
            textures = [self.radiance.textures["radiance"], *(self.sums[name].textures["sum"] for name in names)]
            self._framebuffers[names] = self._context.framebuffer(textures, self.radiance.depth)
            self._framebuffers[names].depth_mask = False
        return self._framebuffers[names]

    def clear(self) -> None:
        """Start all sums at nothing."""
        for target in self.sums.values():
            target.framebuffer.clear()

    def release(self) -> None:
        """All but the radiance, which has its own maker."""
        for target in self.sums.values():
            target.release()
        for framebuffer in self._framebuffers.values():
            free(framebuffer)

    def layers(self, counts: NDArray[np.int32]) -> dict[str, NDArray[np.float32]]:
        """(H, W, C) of each layer that is a sum. counts: (H, W, 1) samples that each pixel got."""
        return {name: _layer(name, target.read("sum"), counts.astype(np.float32)) for name, target in self.sums.items()}


def _layer(name: str, total: NDArray[np.float32], counts: NDArray[np.float32]) -> NDArray[np.float32]:
    match name:
        case "shadow":
            arrived, sent = total[..., :1], total[..., 1:2]
            return np.divide(arrived, sent, out=np.ones_like(sent), where=sent > 0.0)
        case "lightComplexity":
            return total[..., :1] / counts
        case _:
            return total[..., :3] / counts
