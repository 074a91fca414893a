"""What full-screen passes draw: the whole image, or those of its tiles that still need samples."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.targets import Part, Target
from defshade_cli.scene.window import WHOLE_IMAGE

WHOLE = np.array([WHOLE_IMAGE], np.float32)
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


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """What of an image is drawn: tiles (R, C) of `side` pixels.

    seen: around all in which geometry looks otherwise, for a GBuffer that keeps the rest; None for another.
    """

    tiles: NDArray[np.bool_]
    side: int
    seen: Part | None = None


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
    """Keeps passes away from tiles that are done: a depth there that fragments fail before they are shaded.

    Around the others a pixel is drawn too, for passes that read what lies beside theirs.
    open: a part around what is drawn; the whole image where all is done.
    keeps: nothing is hidden, and around that part stays what is there.
    """

    open: Part
    keeps: bool

    def __init__(self, gpu: Gpu) -> None:
        self._context, self._shaders = gpu.context, gpu.shaders
        self._done, self._apart = Screen(gpu), Screen(gpu)
        self.hide_nothing()

    @cached_property
    def _arrays(self) -> dict[Screen, moderngl.VertexArray]:
        """Compiled where the first tile is done."""
        program = self._shaders.program("screen.vert", "depth.frag")
        return {screen: screen.array(program) for screen in (self._done, self._apart)}

    def hide(self, done: NDArray[np.float32], rest: NDArray[np.float32], size: tuple[int, int]) -> None:
        """The (R, 4) regions that are done, and those that are not, of an image of (width, height)."""
        inwards = np.array([1.0, 1.0, -1.0, -1.0]) / np.array(size * 2)
        self._done.cover(done)
        self._apart.cover(done + inwards)
        self.is_empty, self.keeps = not len(done), False
        around = (rest if len(rest) else WHOLE) - inwards
        (left, top), (right, bottom) = around[:, :2].min(axis=0), around[:, 2:].max(axis=0)
        self.open = (max(left, 0.0), max(top, 0.0), min(right, 1.0), min(bottom, 1.0))

    def hide_nothing(self) -> None:
        """All of the image is to be drawn."""
        self.hide(WHOLE[:0], WHOLE, (1, 1))

    def keep_around(self, part: Part) -> None:
        """Draw in a part of the image."""
        self.hide_nothing()
        self.open, self.keeps = part, True

    def shut(self, target: Target, depth: float) -> None:
        """Write a depth where nothing is to be drawn, and no colours."""
        self._fill(self._apart, target, depth)

    def empty(self, target: Target, depth: float) -> None:
        """Write a depth in all that is done, and no colours."""
        self._fill(self._done, target, depth)

    def let_go_of_textures(self, target: Target) -> None:
        """Draw nothing, twice: llvmpipe holds the textures of a draw, deleted or not, until the second one after it."""
        self.hide(np.zeros_like(WHOLE), WHOLE, (1, 1))
        for _ in range(2):
            self.empty(target, 0.0)
            self._context.finish()
        self.hide_nothing()

    def _fill(self, screen: Screen, target: Target, depth: float) -> None:
        if self.is_empty:
            return
        array = self._arrays[screen]
        with target.colours_kept():
            self._context.enable_only(moderngl.DEPTH_TEST)
            self._context.depth_func = "1"
            array.program["screen_depth"] = depth
            screen.draw(array)


class Narrowing:
    """What passes keep to: the regions of a screen, and around them a mask."""

    def __init__(self, screen: Screen, mask: TileMask) -> None:
        self._screen, self._mask = screen, mask

    def to(self, tiles: NDArray[np.bool_], side: int, size: tuple[int, int]) -> None:
        """Some tiles (R, C) of `side` pixels of an image of (width, height)."""
        rest = regions_of(tiles, side, size)
        self._screen.cover(rest)
        self._mask.hide(regions_of(~tiles, side, size), rest, size)

    def end(self) -> None:
        """All of the image from now on."""
        self._screen.cover(WHOLE)
        self._mask.hide_nothing()

    @contextmanager
    def of(self, drawn: Drawn | None, size: tuple[int, int]) -> Iterator[None]:
        """What is drawn of an image of (width, height) within the block; all after it, and where nothing is given."""
        self.end()
        if drawn:
            if drawn.seen is None:
                self.to(drawn.tiles, drawn.side, size)
            else:
                self._screen.cover(regions_of(drawn.tiles, drawn.side, size))
                self._mask.keep_around(drawn.seen)
        try:
            yield
        finally:
            self.end()
