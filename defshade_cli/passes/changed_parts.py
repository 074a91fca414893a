"""The parts of the image in which shadows may fall otherwise, by the place of each pixel in the maps that changed."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import read_source
from defshade_cli.gpu.shaders import set_uniform_bytes
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_lists import TILE, tile_grid
from defshade_cli.passes.screen import Screen, regions_of
from defshade_cli.passes.shadow_changes import MapChange
from defshade_cli.settings import Layout

PART = 8
"""Pixels a side."""

MOST_CHANGES = 32
"""Maps; there is a bit for each."""

_WIDTH = 256
"""Blocks in a row of their texture."""


def parts_of(tiles: NDArray[np.bool_], size: tuple[int, int]) -> NDArray[np.bool_]:
    """Those of tiles (R, C), of an image of (width, height)."""
    columns, rows = tile_grid(size, PART)
    times = TILE // PART
    return tiles.repeat(times, axis=0).repeat(times, axis=1)[:rows, :columns]


class ChangedPartsPass:
    """Compiled for a layout and a projection."""

    def __init__(self, gpu: Gpu, layout: Layout, perspective: bool) -> None:
        self._context, self._screen = gpu.context, Screen(gpu)
        generated = {"generated/planes.glsl": read_source((), layout)}
        defines = [f"LIGHT_TILE {TILE}", f"PART {PART}", f"MOST_CHANGES {MOST_CHANGES}"]
        defines += ["ORTHOGRAPHIC"] * (not perspective)
        program = gpu.shaders.program("screen.vert", "changed_parts.frag", defines=defines, generated=generated)
        self._array = self._screen.array(program)

    def find(
        self, changes: Sequence[MapChange], bits: NDArray[np.uint32], gbuffer: GBuffer, frame: Frame
    ) -> NDArray[np.bool_]:
        """(rows, columns) of parts.

        bits: (R, C) of each tile, which of the changes, MOST_CHANGES at most, may show there.
        gbuffer: the View that it was drawn by is bound.
        """
        size = gbuffer.target.framebuffer.size
        columns, rows = tile_grid(size, PART)
        target = frame.of_tiles("changed", 1, (columns, rows))
        target.framebuffer.use()
        target.framebuffer.clear()
        program, depths = self._array.program, self._describe(changes)
        rows_of_bits, columns_of_bits = bits.shape
        flags = self._context.texture((columns_of_bits, rows_of_bits), 1, bits.tobytes(), dtype="u4")
        for texture in (flags, depths):
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        gbuffer.bind(program, tile_changes=flags, block_depths=depths)
        self._context.enable_only(moderngl.NOTHING)
        self._screen.cover(regions_of(bits != 0, TILE // PART, (columns, rows)))
        self._screen.draw(self._array)
        found = target.read("changed")[..., 0] > 0.0
        flags.release()
        depths.release()
        return found

    def _describe(self, changes: Sequence[MapChange]) -> moderngl.Texture:
        """Let the program find what changes; returns what holds the blocks' depths."""
        matrices = np.zeros((MOST_CHANGES, 4, 4), np.float32)
        grids, heights = np.zeros((MOST_CHANGES, 4), np.int32), np.zeros((MOST_CHANGES, 2), np.int32)
        blocks, count = [], 0
        for number, change in enumerate(changes):
            grid, first = change.grid()
            matrices[number] = change.places_from_relative.T
            grids[number] = *first, grid.shape[1], change.block
            heights[number] = grid.shape[0], count
            blocks.append(grid.reshape(-1, 2))
            count += len(blocks[-1])
        for name, values in (("places_from_relative", matrices), ("grids", grids), ("heights", heights)):
            set_uniform_bytes(self._array.program, name, values.tobytes())
        texels = np.zeros((-(-count // _WIDTH) * _WIDTH, 2), np.float32)
        texels[:count] = np.concatenate(blocks)
        return self._context.texture((_WIDTH, len(texels) // _WIDTH), 2, texels.tobytes(), dtype="f4")
