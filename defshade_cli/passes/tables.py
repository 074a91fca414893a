"""What lights look up: IES profiles as tables of candela, and the bits of their link sets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import moderngl
import numpy as np

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.buffers import LINKS, RecordBuffer
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.linking import NOTHING_LINKED, LinkBits, link_bits
from defshade_cli.plan import Plan

if TYPE_CHECKING:
    from defshade_cli.scene.ies import IesProfile

_ROWS, _COLUMNS = 721, 721
"""Every quarter of a degree vertically and half a degree around: what files give, and exact between."""


@dataclass(frozen=True, slots=True, eq=False)
class LightTables:
    """profiles: the layers of candela, by vertical and horizontal angle.  links: bound where the plan links."""

    profiles: tuple[IesProfile, ...] = ()
    candela: moderngl.TextureArray | None = None
    links: LinkBits = NOTHING_LINKED


NO_TABLES = LightTables()


class TableStore:
    """The tables of one plan after another; profiles stay on the device while the next plan has the same."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._links = RecordBuffer(gpu, LINKS)
        self._tables = NO_TABLES

    def update(self, plan: Plan) -> LightTables:
        """Make the plan's tables resident."""
        candela = self._tables.candela
        if plan.profiles != self._tables.profiles:
            if candela:
                candela.release()
            candela = self._upload(plan.profiles) if plan.profiles else None
        links = link_bits(planned.light for planned in plan.lights)
        if links.lights:
            self._links.write(links.words)
        self._tables = LightTables(plan.profiles, candela, links)
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
