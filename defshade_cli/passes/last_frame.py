"""What the frame that was drawn last leaves to the next one: its film, and what its tiles show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.image.film import Film
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.gbuffer import GBuffer
from defshade_cli.passes.sampling import CENTRE
from defshade_cli.passes.shadow_changes import MapChange, shadowed
from defshade_cli.passes.tile_depths import TileDepths, boxes_at
from defshade_cli.passes.view import placement
from defshade_cli.plan import Plan

Tiles = NDArray[np.bool_]
"""(R, C) rows and columns of the image."""


class LastFrame:
    """Told of each frame that is drawn, and asked by the next."""

    def __init__(self, gpu: Gpu, frame: Frame) -> None:
        self._reading = TileDepths(gpu, frame)
        self.forget()

    def forget(self) -> None:
        """The GBuffer holds something else from now on."""
        self._film: Film | None = None
        self._tiles: Tiles | None = None
        self._depths: NDArray[np.float64] | None = None

    def keep(self, film: Film, tiles: Tiles | None) -> None:
        """A frame that was drawn in some tiles beside what was there, or whole."""
        self._film, self._tiles = film, tiles
        if tiles is None:
            self._depths = None

    def is_of(self, film: Film) -> bool:
        """Is it the one?"""
        return film is self._film

    def shadowed_tiles(self, changes: Sequence[MapChange], gbuffer: GBuffer, plan: Plan) -> Tiles:
        """Those in which something that is where it was may have other shadows. gbuffer: as the last frame left it."""
        boxes = boxes_at(self._known_depths(gbuffer, plan), plan, CENTRE)
        shows = (boxes[..., 0, :] <= boxes[..., 1, :]).all(axis=-1)
        found = np.zeros_like(shows)
        found[shows] = shadowed(boxes[shows], changes, placement(plan.camera, CENTRE))
        return found

    def _known_depths(self, gbuffer: GBuffer, plan: Plan) -> NDArray[np.float64]:
        """(R, C, 2): where the last frame did not draw, the GBuffer is empty."""
        depths = self._reading.read(gbuffer, plan)
        if self._tiles is not None:
            assert self._depths is not None
            depths = np.where(self._tiles[..., None], depths, self._depths)
        self._depths = depths
        return depths
