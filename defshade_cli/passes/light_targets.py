"""What lights are drawn into: the radiance of a sample, and sums over all samples that some layers show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.targets import Target, allocate
from defshade_cli.plan import Plan

Groups = tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class LightTargets:
    """radiance: of one sample.  sums: layer → what it has over all samples, blended straight into.

    framebuffers: for the lights of each set of groups, the radiance, the outputs that every light has, and the groups.
    """

    radiance: Target
    sums: Mapping[str, Target]
    framebuffers: Mapping[Groups, moderngl.Framebuffer]

    def clear(self) -> None:
        for target in self.sums.values():
            target.framebuffer.clear()

    def release(self) -> None:
        """All but the radiance, which has its own maker."""
        for target in self.sums.values():
            target.release()
        for groups in self.framebuffers:
            if self.framebuffers[groups] is not self.radiance.framebuffer:
                self.framebuffers[groups].release()

    def layers(self, counts: NDArray[np.int32]) -> dict[str, NDArray[np.float32]]:
        """(H, W, C) of each layer that is a sum. counts: (H, W, 1) samples that each pixel got."""
        return {name: _layer(name, target.read("sum"), counts.astype(np.float32)) for name, target in self.sums.items()}


def make_light_targets(gpu: Gpu, radiance: Target, plan: Plan) -> LightTargets:
    """Targets for a plan's lights. Raises GpuError."""
    names = (*plan.outputs, *plan.groups)
    sums = {name: allocate(gpu, plan.size, {"sum": (4, "f4")}) for name in names}
    together = {planned.groups for planned in plan.lights} | {()}
    framebuffers = {
        groups: _framebuffer(gpu, radiance, [sums[n] for n in (*plan.outputs, *groups)]) for groups in together
    }
    return LightTargets(radiance, sums, framebuffers)


def _framebuffer(gpu: Gpu, radiance: Target, sums: list[Target]) -> moderngl.Framebuffer:
    if not sums:
        return radiance.framebuffer
    textures = [radiance.textures["radiance"], *(target.textures["sum"] for target in sums)]
    framebuffer = gpu.context.framebuffer(textures, radiance.depth)
    framebuffer.depth_mask = False
    return framebuffer


def _layer(name: str, total: NDArray[np.float32], counts: NDArray[np.float32]) -> NDArray[np.float32]:
    match name:
        case "shadow":
            arrived, sent = total[..., :1], total[..., 1:2]
            return np.divide(arrived, sent, out=np.ones_like(sent), where=sent > 0.0)
        case "lightComplexity":
            return total[..., :1] / counts
        case _:
            return total[..., :3] / counts
