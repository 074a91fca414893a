"""The display pass: a scene-linear image as a display shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.shaders import set_uniforms
from defshade_cli.gpu.targets import allocate
from defshade_cli.image.colour import BRIGHTEST, Pixels
from defshade_cli.passes.screen import Screen

if TYPE_CHECKING:
    from defshade_cli.image.display_shader import DisplayShader, Table

_BAND = 2**19
"""Pixels shown at a time."""


class DisplayPass:
    """Compiled for one transform."""

    def __init__(self, gpu: Gpu, shader: DisplayShader) -> None:
        self._gpu = gpu
        generated = {"generated/display.glsl": shader.source}
        self._program = gpu.shaders.program("screen.vert", "display.frag", generated=generated)
        self._screen = Screen(gpu)
        self._array = self._screen.array(self._program)
        self._tables = {table.sampler: _texture(gpu, table) for table in shader.tables}
        self._last: dict[tuple[str, bool, bool], tuple[Pixels, NDArray[Any]]] = {}

    def show(
        self, pixels: Pixels, *, straight: bool, in_bytes: bool = False, of: str = ""
    ) -> NDArray[np.float32] | NDArray[np.uint8]:
        """(H, W, 3 or 4), premultiplied → the same shape in [0, 1], or of bytes, rounded.

        straight: colours come out without their alpha.  of: whose picture it is: rows that are as they were when it was
        last shown are not worked out again. Raises GpuError.
        """
        before = self._last.get((of, straight, in_bytes))
        if before is None or before[0].shape != pixels.shape:
            shown = self._draw(pixels, straight, in_bytes)
        else:
            changed, shown = (pixels != before[0]).any(axis=(1, 2)), before[1].copy()
            if changed.any():
                shown[changed] = self._draw(pixels[changed], straight, in_bytes)
        self._last[of, straight, in_bytes] = pixels, shown
        return shown

    def _draw(self, pixels: Pixels, straight: bool, in_bytes: bool) -> NDArray[np.float32] | NDArray[np.uint8]:
        """A band of rows at a time, so that little memory is taken."""
        self._gpu.make_current()
        height, width, channels = pixels.shape
        rows = min(max(_BAND // width, 1), height)
        target = allocate(self._gpu, (width, rows), {"shown": (4, "f1" if in_bytes else "f4")})
        image = self._gpu.context.texture((width, rows), channels, dtype="f4")
        image.use(0)
        set_uniforms(self._program, {"image": 0, "straight": straight, "brightest": BRIGHTEST})
        for unit, (name, table) in enumerate(self._tables.items(), 1):
            table.use(unit)
            self._program[name] = unit
        target.framebuffer.use()
        self._gpu.context.enable_only(moderngl.NOTHING)
        shown = np.empty(pixels.shape, np.uint8 if in_bytes else np.float32)
        for top in range(0, height, rows):
            band = np.ascontiguousarray(pixels[top : top + rows])
            image.write(band, viewport=(0, 0, width, len(band)))
            self._screen.draw(self._array)
            shown[top : top + rows] = target.read("shown")[: len(band), :, :channels]
        image.release()
        target.release()
        return shown


def _texture(gpu: Gpu, table: Table) -> moderngl.Texture | moderngl.Texture3D:
    *shape, channels = table.values.shape
    make = gpu.context.texture if len(shape) == 2 else gpu.context.texture3d
    texture = gpu.keep(make(tuple(reversed(shape)), channels, np.ascontiguousarray(table.values).tobytes(), dtype="f4"))
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR) if table.smooth else (moderngl.NEAREST, moderngl.NEAREST)
    texture.repeat_x = texture.repeat_y = False
    if isinstance(texture, moderngl.Texture3D):
        texture.repeat_z = False
    return texture
