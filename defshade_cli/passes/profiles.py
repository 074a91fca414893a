"""IES profiles as tables on the GPU: candela by horizontal and vertical angle, a layer a profile."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from defshade_cli.gpu.context import Gpu
from defshade_cli.scene.ies import IesProfile

_ROWS, _COLUMNS = 721, 721
"""Every quarter of a degree vertically and half a degree around: what files give, and exact between."""


class ProfileTables:
    """The tables of one frame's lights after another's; those of the last are kept while the next has the same."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._profiles: tuple[IesProfile, ...] = ()
        self._tables: moderngl.TextureArray | None = None

    def update(self, profiles: Sequence[IesProfile]) -> moderngl.TextureArray | None:
        """The profiles as layers in their order; None without any."""
        if tuple(profiles) != self._profiles:
            if self._tables:
                self._tables.release()
            self._profiles = tuple(profiles)
            self._tables = self._upload(self._profiles) if profiles else None
        return self._tables

    def _upload(self, profiles: Sequence[IesProfile]) -> moderngl.TextureArray:
        vertical, horizontal = np.linspace(0.0, 180.0, _ROWS), np.linspace(0.0, 360.0, _COLUMNS)
        horizontal[-1] = 0.0
        candela = [profile.at(vertical[:, None], horizontal[None, :]) for profile in profiles]
        tables = self._gpu.context.texture_array(
            (_COLUMNS, _ROWS, len(profiles)), 1, np.array(candela, np.float32).tobytes(), dtype="f4"
        )
        tables.filter = (moderngl.LINEAR, moderngl.LINEAR)
        tables.repeat_x = tables.repeat_y = False
        return tables
