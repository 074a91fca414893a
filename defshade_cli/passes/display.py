"""The display pass: a scene-linear image as a display shows it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.shaders import set_textures, set_uniforms
from defshade_cli.gpu.targets import allocate
from defshade_cli.image.colour import BRIGHTEST, Pixels
from defshade_cli.image.display_table import CELLS, MOST, TOE, Lattice
from defshade_cli.passes.screen import Screen

if TYPE_CHECKING:
    from defshade_cli.image.display_shader import DisplayShader

_BAND = 2**19
"""Pixels shown at a time."""

_PIECE = 64
"""Pixels in a row, that are shown again where one of them changes; less in images whose width is no multiple of it."""

_RGBA = 4

_MIDDLE = 0.5
"""A depth between those that the table's shader writes: 0 where the transform itself is wanted, else 1."""

_BY_TABLE = '#include "lib/display_table.glsl"'
_DEFINES = (f"TABLE_CELLS {CELLS}", f"TABLE_TOE {TOE}", f"TABLE_MOST {MOST}")

Texture = moderngl.Texture | moderngl.Texture3D


class DisplayPass:
    """Compiled for one transform. table: of the same, for pictures in bytes, as far as it is near enough."""

    def __init__(self, gpu: Gpu, shader: DisplayShader, table: Lattice | None = None) -> None:
        self._gpu = gpu
        tables = {each.sampler: _texture(gpu, each.values, smooth=each.smooth) for each in shader.tables}
        self._exact = _Shader(gpu, shader.source, tables)
        lattice = None if table is None else _texture(gpu, table.astype(np.float32), smooth=False)
        self._table = None if lattice is None else _Shader(gpu, _BY_TABLE, lattice=lattice)
        self._last: dict[tuple[str, bool, bool], tuple[Pixels, NDArray[Any]]] = {}

    def show(
        self, pixels: Pixels, *, straight: bool, in_bytes: bool = False, of: str = ""
    ) -> NDArray[np.float32] | NDArray[np.uint8]:
        """(H, W, 3 or 4), premultiplied → the same shape in [0, 1], or of bytes, rounded.

        straight: colours come out without their alpha.  of: whose picture it is: pieces of rows that are as they were
        when it was last shown are not worked out again. Raises GpuError.
        """
        before = self._last.get((of, straight, in_bytes))
        if before is None or before[0].shape != pixels.shape:
            shown = self._draw(pixels, straight, in_bytes)
        else:
            pieces, shown = _in_pieces(pixels), before[1].copy()
            changed = (pieces != _in_pieces(before[0])).any(axis=(2, 3))
            if changed.any():
                drawn = self._draw(_in_rows(pieces[changed], pieces.shape[1]), straight, in_bytes)
                _in_pieces(shown)[changed] = drawn.reshape(-1, *pieces.shape[2:])[: changed.sum()]
        self._last[of, straight, in_bytes] = pixels, shown
        return shown

    def _draw(self, pixels: Pixels, straight: bool, in_bytes: bool) -> NDArray[np.float32] | NDArray[np.uint8]:
        """A band of rows at a time, so that little memory is taken."""
        self._gpu.make_current()
        height, width, channels = pixels.shape
        rows = min(max(_BAND // width, 1), height)
        table = self._table if in_bytes else None
        depth = self._gpu.depth_texture((width, rows)) if table else None
        target = allocate(self._gpu, (width, rows), {"shown": (4, "f1" if in_bytes else "f4")}, depth)
        image = self._gpu.context.texture((width, rows), _RGBA, dtype="f4")
        shown = np.empty(pixels.shape, np.uint8 if in_bytes else np.float32)
        for top in range(0, height, rows):
            band = _opaque(pixels[top : top + rows])
            image.write(band, viewport=(0, 0, width, len(band)))
            target.framebuffer.use()
            if table:
                table.draw(image, straight, depth="1")
            self._exact.draw(image, straight, depth=">" if table else None)
            shown[top : top + rows] = target.read("shown")[: len(band), :, :channels]
        target.release()
        for texture in filter(None, (image, depth)):
            texture.release()
        return shown


def _in_pieces(pixels: NDArray[Any]) -> NDArray[Any]:
    """(H, N, W / N, C) of (H, W, C): a view."""
    height, width, channels = pixels.shape
    count = width // math.gcd(width, _PIECE)
    return pixels.reshape(height, count, -1, channels)


def _in_rows(pieces: NDArray[Any], count: int) -> NDArray[Any]:
    """(H, W, C) of pieces (K, P, C), so many in a row; the last row is filled with zeros."""
    rows = np.zeros((-(-len(pieces) // count) * count, *pieces.shape[1:]), pieces.dtype)
    rows[: len(pieces)] = pieces
    return rows.reshape(-1, count * pieces.shape[1], pieces.shape[2])


class _Shader:
    """display.frag. source: GLSL with `vec4 display(vec4 color)`, which samples tables or loads a lattice."""

    def __init__(
        self, gpu: Gpu, source: str, tables: dict[str, Texture] | None = None, lattice: Texture | None = None
    ) -> None:
        self._context, self._screen, self._tables, self._lattice = gpu.context, Screen(gpu), tables or {}, lattice
        generated = {"generated/display.glsl": source}
        self._program = gpu.shaders.program("screen.vert", "display.frag", defines=_DEFINES, generated=generated)
        self._array = self._screen.array(self._program)

    def draw(self, image: moderngl.Texture, straight: bool, depth: str | None) -> None:
        """depth: how a depth in the middle is compared with what is stored, if it is."""
        self._context.enable_only(moderngl.DEPTH_TEST if depth else moderngl.NOTHING)
        if depth:
            self._context.depth_func = depth
        set_textures(self._program, self._tables)
        image.bind_to_image(0, read=True, write=False)
        if self._lattice:
            self._lattice.bind_to_image(1, read=True, write=False)
        set_uniforms(self._program, {"straight": straight, "brightest": BRIGHTEST, "screen_depth": _MIDDLE})
        self._screen.draw(self._array)


def _opaque(pixels: Pixels) -> Pixels:
    """(H, W, 3 or 4) → (H, W, 4), contiguous."""
    if pixels.shape[-1] == _RGBA:
        return np.ascontiguousarray(pixels)
    return np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=-1)


def _texture(gpu: Gpu, values: NDArray[Any], *, smooth: bool) -> Texture:
    """(H, W, C) or (D, H, W, C)."""
    *shape, channels = values.shape
    make = gpu.context.texture if values.ndim == 3 else gpu.context.texture3d
    texture = gpu.keep(make(tuple(reversed(shape)), channels, np.ascontiguousarray(values).tobytes(), dtype="f4"))
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR) if smooth else (moderngl.NEAREST, moderngl.NEAREST)
    texture.repeat_x = texture.repeat_y = False
    if isinstance(texture, moderngl.Texture3D):
        texture.repeat_z = False
    return texture
