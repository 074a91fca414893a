"""The display pass: a scene-linear image as a display shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.targets import allocate
from defshade_cli.image.colour import finite
from defshade_cli.passes.screen import Screen

if TYPE_CHECKING:
    from defshade_cli.image.display_shader import DisplayShader, Table


class DisplayPass:
    """Compiled for one transform."""

    def __init__(self, gpu: Gpu, shader: DisplayShader) -> None:
        self._gpu = gpu
        generated = {"generated/display.glsl": shader.source}
        self._program = gpu.shaders.program("screen.vert", "display.frag", generated=generated)
        self._screen = Screen(gpu)
        self._array = self._screen.array(self._program)
        self._tables = {table.sampler: _texture(gpu, table) for table in shader.tables}

    def show(self, pixels: NDArray[np.float32], *, straight: bool) -> NDArray[np.float32]:
        """(H, W, 3 or 4), premultiplied → the same shape in [0, 1]. straight: colours come out without their alpha."""
        self._gpu.make_current()
        height, width, channels = pixels.shape
        target = allocate(self._gpu, (width, height), {"shown": (4, "f4")})
        image = self._gpu.context.texture((width, height), channels, finite(pixels).tobytes(), dtype="f4")
        image.use(0)
        self._program["image"], self._program["straight"] = 0, straight
        for unit, (name, table) in enumerate(self._tables.items(), 1):
            table.use(unit)
            self._program[name] = unit
        target.framebuffer.use()
        self._gpu.context.enable_only(moderngl.NOTHING)
        self._screen.draw(self._array)
        shown = target.read("shown")[..., :channels]
        image.release()
        target.release()
        return np.ascontiguousarray(shown)


def _texture(gpu: Gpu, table: Table) -> moderngl.Texture | moderngl.Texture3D:
    *shape, channels = table.values.shape
    make = gpu.context.texture if len(shape) == 2 else gpu.context.texture3d
    texture = gpu.keep(make(tuple(reversed(shape)), channels, np.ascontiguousarray(table.values).tobytes(), dtype="f4"))
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR) if table.smooth else (moderngl.NEAREST, moderngl.NEAREST)
    texture.repeat_x = texture.repeat_y = False
    if isinstance(texture, moderngl.Texture3D):
        texture.repeat_z = False
    return texture
