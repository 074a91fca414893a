"""What the frame that was drawn last leaves to the next one: its film, and a GBuffer of all that it showed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.image.film import Film
from defshade_cli.passes.changed_parts import MOST_CHANGES, ChangedPartsPass, parts_of
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.sampling import CENTRE
from defshade_cli.passes.shadow_changes import MapChange, maps_that_change
from defshade_cli.passes.tile_depths import TileDepths, boxes_at
from defshade_cli.passes.view import placement
from defshade_cli.plan import Plan

Parts = NDArray[np.bool_]
"""(R, C) rows and columns of the image's parts."""


class LastFrame:
    """Told of each frame that is drawn, and asked by the next."""

    def __init__(self, gpu: Gpu, frame: Frame) -> None:
        self._frame, self._depths = frame, TileDepths(gpu, frame)
        self._parts = cache(lambda *kind: ChangedPartsPass(gpu, *kind))
        self.forget()

    def forget(self) -> None:
        """The GBuffer holds something else from now on."""
        self._film: Film | None = None

    def keep(self, film: Film) -> None:
        """A frame that was drawn, of which the GBuffer has all."""
        self._film = film

    def is_of(self, film: Film) -> bool:
        """Is it the one?"""
        return film is self._film

    def shadowed_parts(
        self, changes: Sequence[MapChange], moved: NDArray[np.bool_], gbuffer: GBuffer, plan: Plan
    ) -> Parts:
        """Those of tiles that are not `moved` (R, C), in which shadows may fall otherwise.

        gbuffer: as the last frame left it, whose View is bound.
        """
        boxes = boxes_at(self._depths.read(gbuffer, plan), plan, CENTRE)
        shows = (boxes[..., 0, :] <= boxes[..., 1, :]).all(axis=-1) & ~moved
        met = np.zeros((len(changes), *shows.shape), bool)
        met[:, shows] = maps_that_change(boxes[shows], changes, placement(plan.camera, CENTRE))
        tiles = np.asarray(met.any(axis=0))
        if not tiles.any() or len(changes) > MOST_CHANGES:
            return parts_of(tiles, plan.size)
        bits = np.left_shift(met, np.arange(len(changes), dtype=np.uint32)[:, None, None], dtype=np.uint32)
        find = self._parts(gbuffer.layout, plan.camera.projection == "perspective").find
        return find(changes, bits.sum(axis=0, dtype=np.uint32), gbuffer, self._frame)
