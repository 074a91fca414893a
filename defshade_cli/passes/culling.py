"""Which draws a view may see, and the indirect buffer that holds those."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu

_ROUNDING = 1e-5  # what float32 may move a corner, over the greatest coordinate


def may_see(clip_from_relative: NDArray[np.float32], corners: NDArray[np.float64]) -> NDArray[np.bool_]:
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


class CommandBuffer:
    """Indirect commands, written anew for every view."""

    def __init__(self, gpu: Gpu) -> None:
        self.buffer = gpu.keep(gpu.context.buffer(reserve=256))

    def write(self, commands: NDArray) -> None:
        data = commands.tobytes()
        self.buffer.orphan(max(len(data), self.buffer.size))
        self.buffer.write(data)
