"""The light volumes themselves, in colours over the image: how far each light is taken to reach."""

from __future__ import annotations

from functools import cache

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.buffers import LIGHTS, RecordBuffer
from defshade_cli.gpu.context import DEPTH_CLAMP, Gpu
from defshade_cli.gpu.planes import uses_standard_depth
from defshade_cli.gpu.targets import Target
from defshade_cli.passes.light_records import light_records
from defshade_cli.passes.lighting import volume_array
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.tables import LightTables
from defshade_cli.plan import Plan, Volume
from defshade_cli.scene.emission import far_field
from defshade_cli.settings import Layout

_FILL, _WIRE, _HIDDEN, _FRAME = 0.03, 0.3, 0.08, 0.9
"""Opacity of a volume's faces, of its edges, of edges behind geometry, and of a quad's frame."""


class DebugVolumesPass:
    """Compiled as kinds of volume are met."""

    def __init__(self, gpu: Gpu) -> None:
        self._context, self._screen = gpu.context, Screen(gpu)
        self._records = RecordBuffer(gpu, LIGHTS)
        self._array = cache(lambda volume: self._compiled(gpu, volume))

    def draw(self, plan: Plan, tables: LightTables, target: Target, layout: Layout) -> NDArray[np.float32]:
        """(H, W, 4) premultiplied: the volumes of the plan's lights, domes apart, as the depth shows them."""
        lights = [planned for planned in plan.lights if planned not in plan.domes]
        emitters = [far_field(planned.light) for planned in lights]
        self._records.write(light_records(lights, emitters, plan.camera.position, None, tables))
        self._clear(target)
        self._context.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        self._context.depth_func = "<" if uses_standard_depth(layout) else ">"
        self._context.enable_direct(DEPTH_CLAMP)
        for number, planned in enumerate(lights):
            self._draw_light(planned.volume, number)
        self._context.disable_direct(DEPTH_CLAMP)
        return target.read("radiance").astype(np.float32)

    def _clear(self, target: Target) -> None:
        """The colours, not the depth."""
        target.framebuffer.use()
        target.framebuffer.depth_mask = False
        target.framebuffer.clear()

    def _draw_light(self, volume: Volume, number: int) -> None:
        array = self._array(volume)
        array.program["light_number"] = number
        if volume == "quad":
            self._context.enable_only(moderngl.BLEND)
            array.program["opacity"] = _FRAME
            self._screen.draw(array)
            return
        array.program["first_light"] = number
        visible = moderngl.BLEND | moderngl.DEPTH_TEST
        for flags, wireframe, opacity in (
            (visible, False, _FILL),
            (visible, True, _WIRE),
            (moderngl.BLEND, True, _HIDDEN),
        ):
            self._context.enable_only(flags)
            self._context.wireframe = wireframe
            array.program["opacity"] = opacity
            array.render(instances=1)
        self._context.wireframe = False

    def _compiled(self, gpu: Gpu, volume: Volume) -> moderngl.VertexArray:
        defines = ["VOLUME_QUAD"] * (volume == "quad")
        program = gpu.shaders.program(f"light_{volume}.vert", "debug_volumes.frag", defines=defines)
        return self._screen.array(program) if volume == "quad" else volume_array(gpu, volume, program)


def laid_over(image: NDArray[np.float32], overlay: NDArray[np.float32]) -> NDArray[np.float32]:
    """`overlay` over `image`, both (H, W, 4) and premultiplied; opaque, or faint colours would be lost on nothing."""
    over = overlay + image * (1.0 - overlay[..., 3:])
    over[..., 3] = 1.0
    return over
