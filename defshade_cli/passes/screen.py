"""What full-screen passes draw: the whole image, or those of its tiles that still need samples."""

from __future__ import annotations

from functools import cached_property

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.targets import Target

WHOLE = np.array([[0.0, 0.0, 1.0, 1.0]], np.float32)
"""The one region that is all of the image: left, top, right, bottom as shares of it."""


def regions_of(tiles: NDArray[np.bool_], side: int, size: tuple[int, int]) -> NDArray[np.float32]:
    """(R, 4) rectangles that cover some of the tiles of `side` pixels of an image of (width, height), and no others.

    tiles: (rows, columns). Left, top, right, bottom as shares of the image: runs in a row, joined over equal rows.
    """
    steps = np.diff(np.pad(tiles, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    (row, first), (_, end) = np.nonzero(steps == 1), np.nonzero(steps == -1)
    order = np.lexsort((row, end, first))
    row, first, end = row[order], first[order], end[order]
    starts = np.ones(len(row), bool)
    starts[1:] = (np.diff(first) != 0) | (np.diff(end) != 0) | (np.diff(row) != 1)
    last = np.append(np.flatnonzero(starts)[1:], len(row)) - 1
    corners = np.column_stack([first[starts], row[starts], end[starts], row[last[: starts.sum()]] + 1]) * side
    return np.minimum(corners / np.array(size * 2), 1.0).astype(np.float32)


class Screen:
    """Rectangles that shaders/screen.vert draws as instances of one quad."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._regions = gpu.keep(gpu.context.buffer(WHOLE.tobytes()))
        self._count = 1

    def cover(self, regions: NDArray[np.float32]) -> None:
        """Draw the (R, 4) regions from now on: left, top, right, bottom as shares of the image."""
        self._regions.orphan(max(regions.nbytes, WHOLE.nbytes))
        self._regions.write(np.ascontiguousarray(regions, np.float32))
        self._count = len(regions)

    def array(self, program: moderngl.Program) -> moderngl.VertexArray:
        """For a program whose vertex shader is screen.vert, or reads `region` like it."""
        return self._gpu.keep(self._gpu.context.vertex_array(program, [(self._regions, "4f/i", "region")]))

    def draw(self, array: moderngl.VertexArray) -> None:
        """Draw a quad for each of the regions; nothing where there is none."""
        if self._count:
            array.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=self._count)


class TileMask:
    """Keeps passes away from tiles that are done: a depth there that fragments fail before they are shaded."""

    def __init__(self, gpu: Gpu) -> None:
        self._context, self._shaders = gpu.context, gpu.shaders
        self._finished = Screen(gpu)
        self.hide(WHOLE[:0])

    @cached_property
    def _array(self) -> moderngl.VertexArray:
        """Compiled where the first tile is done."""
        return self._finished.array(self._shaders.program("screen.vert", "depth.frag"))

    def hide(self, regions: NDArray[np.float32]) -> None:
        """The (R, 4) regions that are done."""
        self._finished.cover(regions)
        self.is_empty = not len(regions)

    def fill(self, target: Target, depth: float) -> None:
        """Write one depth there; what the colours hold there is undefined afterwards."""
        if self.is_empty:
            return
        target.framebuffer.use()
        self._context.enable_only(moderngl.DEPTH_TEST)
        self._context.depth_func = "1"
        self._array.program["screen_depth"] = depth
        self._finished.draw(self._array)
