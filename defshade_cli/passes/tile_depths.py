"""The depths between which the pixels of the image's tiles lie, and the boxes around what they show."""

from __future__ import annotations

from functools import cache

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.planes import read_source
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.light_lists import TILE, tile_boxes, tile_grid
from defshade_cli.passes.sampling import Sample
from defshade_cli.passes.screen import Screen
from defshade_cli.passes.view import seen_window
from defshade_cli.plan import Plan
from defshade_cli.settings import Layout


class TileDepths:
    """Of a GBuffer, as last drawn."""

    def __init__(self, gpu: Gpu, frame: Frame) -> None:
        self._frame = frame
        self._ranges = cache(lambda *kind: DepthRangesPass(gpu, *kind))

    def read(self, gbuffer: GBuffer, plan: Plan) -> NDArray[np.float64]:
        """(rows, columns, 2) nearest and farthest planar depth, the other way round in tiles without geometry."""
        perspective = plan.camera.projection == "perspective"
        return self._ranges(gbuffer.layout, perspective).read(gbuffer, self._frame, plan.size)


def boxes_at(depths: NDArray[np.float64], plan: Plan, sample: Sample) -> NDArray[np.float64]:
    """(rows, columns, 2, 3) in camera space around what tiles show between depths (rows, columns, 2)."""
    perspective = plan.camera.projection == "perspective"
    return tile_boxes(depths, seen_window(plan, sample), plan.size, perspective=perspective)


class DepthRangesPass:
    """The depths between which a tile's pixels lie; compiled for a layout and a projection."""

    def __init__(self, gpu: Gpu, layout: Layout, perspective: bool) -> None:
        self._context, self._screen = gpu.context, Screen(gpu)
        generated = {"generated/planes.glsl": read_source((), layout)}
        defines = [f"LIGHT_TILE {TILE}"] + ["ORTHOGRAPHIC"] * (not perspective)
        program = gpu.shaders.program("screen.vert", "depth_ranges.frag", defines=defines, generated=generated)
        self._array = self._screen.array(program)

    def read(self, gbuffer: GBuffer, frame: Frame, size: tuple[int, int]) -> NDArray[np.float64]:
        """(rows, columns, 2) nearest and farthest planar depth, the other way round in tiles without geometry."""
        target = frame.of_tiles("range", 2, tile_grid(size))
        target.framebuffer.use()
        self._context.enable_only(moderngl.NOTHING)
        gbuffer.bind(self._array.program)
        self._screen.draw(self._array)
        return target.read("range").astype(np.float64)
