"""Buffers that shaders read: where they are bound, and records in them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu

(
    INSTANCES,
    MATERIALS,
    LIGHTS,
    LIGHT_LISTS,
    TEXTURE_INPUTS,
    TILES,
    LINKS,
    MOTIONS,
    BOXES,
    TRIANGLES,
    LAMPS,
    CELLS,
) = range(1, 13)
"""Binding points of the storage buffers, as the shaders declare them."""

LIGHT_BLOCK, SHADOW_BLOCK, VIEW_BLOCK = range(3)
"""Binding points of the uniform buffers."""

_TURNS = 8


class RecordBuffer:
    """A storage buffer of records at one binding, or a uniform one; it grows as it must.

    llvmpipe does not know which storage buffers its queued draws still read, so there a write goes to the next of a
    few, and waits for the draws once they have all been written.
    """

    def __init__(self, gpu: Gpu, binding: int, *, uniform: bool = False) -> None:
        self._gpu, self._binding, self._uniform = gpu, binding, uniform
        self._buffers = [gpu.keep(gpu.context.buffer(reserve=256)) for _ in range(_TURNS if gpu.is_software else 1)]
        self._turn = 0

    def write(self, records: NDArray[Any]) -> None:
        """Upload `records` (N,) and bind the buffer."""
        if self._gpu.is_software and self._turn == 0:
            self._gpu.context.finish()
        buffer, self._turn = self._buffers[self._turn], (self._turn + 1) % len(self._buffers)
        if records.nbytes > buffer.size:
            buffer.orphan(records.nbytes)
        buffer.write(np.ascontiguousarray(records))
        bind = buffer.bind_to_uniform_block if self._uniform else buffer.bind_to_storage_buffer
        bind(self._binding)


def replaced(gpu: Gpu, old: Iterable[moderngl.Buffer], arrays: Iterable[NDArray[Any]]) -> list[moderngl.Buffer]:
    """A buffer for each array (N, …), the old ones freed before; the caller's to keep."""
    for buffer in old:
        buffer.release()
    return [gpu.context.buffer(np.ascontiguousarray(a) if a.size else bytes(4)) for a in arrays]
