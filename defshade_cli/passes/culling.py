"""Which draws a view may see, and the indirect buffer that holds those."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.targets import Part
from defshade_cli.scene.camera import Camera
from defshade_cli.spaces import transform_points

_ROUNDING = 1e-5  # what float32 may move a corner, over the greatest coordinate

_MOST_QUEUED = 2**16
"""Triangles, about, that a software rasteriser sets up before it draws them, some 350 bytes each."""


def may_see(clip_from_relative: NDArray[np.floating], corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(C,) False for boxes (C, 8, 3) that lie wholly beyond a plane of the frustum.

    clip_from_relative: (4, 4), transposed as records hold it; depth in [0, 1] either way round. Boxes that are not
    finite may be seen.
    """
    with np.errstate(invalid="ignore"):
        clip = corners @ clip_from_relative[:3].astype(np.float64) + clip_from_relative[3]
        xyz, w = clip[..., :3], clip[..., 3:]
        slack = _ROUNDING * np.abs(clip).max(axis=(1, 2), keepdims=True)
        below, above = xyz < np.array([-1.0, -1.0, 0.0]) * w - slack, xyz > w + slack
    return ~(below.all(axis=1) | above.all(axis=1)).any(axis=1)


def is_clear_of(camera: Camera, corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(C,) True for boxes (C, 8, 3) of which nothing lies between the eye and the near plane of its frustum."""
    near = camera.clipping_range[0]
    if camera.projection == "orthographic":
        return np.asarray((-transform_points(camera.camera_from_world, corners)[..., 2] > near).all(axis=1))
    left, right, bottom, top = camera.window
    reach = near * math.hypot(1.0, max(-left, right), max(-bottom, top))
    nearest = np.clip(camera.position, corners.min(axis=1), corners.max(axis=1))
    return np.asarray(np.linalg.norm(nearest - camera.position, axis=1) > reach)


def clip_of_part(clip_from_relative: NDArray[np.float32], part: Part) -> NDArray[np.floating]:
    """(4, 4), transposed likewise: what sees a part of the image, which has some width and height."""
    left, top, right, bottom = part
    clip = clip_from_relative.astype(np.float64)
    for axis, low, high in ((0, 2.0 * left - 1.0, 2.0 * right - 1.0), (1, 1.0 - 2.0 * bottom, 1.0 - 2.0 * top)):
        clip[:, axis] = (clip[:, axis] - 0.5 * (low + high) * clip[:, 3]) * (2.0 / (high - low))
    return clip


class CommandBuffer:
    """Indirect commands, written anew for every view, in runs that different programs draw."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu, self._buffer = gpu, gpu.keep(gpu.context.buffer(reserve=256))
        self._ends = self._breaks = np.zeros(1, np.int64)

    def write(self, runs: Sequence[NDArray[Any]]) -> None:
        """Upload runs of draw commands, (N,) records each, one behind the other."""
        commands = np.concatenate(runs)
        self._ends = np.cumsum([0, *map(len, runs)])
        self._breaks = _breaks(commands) if self._gpu.is_software else np.empty(0, np.int64)
        self._buffer.orphan(max(commands.nbytes, self._buffer.size))
        self._buffer.write(commands)

    def is_empty(self, run: int) -> bool:
        """Has a run no commands?"""
        return bool(self._ends[run] == self._ends[run + 1])

    def render(self, array: moderngl.VertexArray, run: int) -> None:
        """Draw a run of those that were written."""
        first, end = (int(place) for place in self._ends[run : run + 2])
        breaks = self._breaks[(self._breaks >= first) & (self._breaks < end)].tolist()
        for start, stop in pairwise([first, *breaks, end]):
            if start in breaks:
                self._gpu.context.finish()
            if stop > start:
                array.render_indirect(self._buffer, count=stop - start, first=start)


def _breaks(commands: NDArray[Any]) -> NDArray[np.int64]:
    """Before which of the (N,) commands what came before is drawn to its end."""
    triangles = np.cumsum(commands["count"].astype(np.int64) // 3 * commands["instances"])
    return np.flatnonzero(np.diff(triangles // _MOST_QUEUED)) + 1
