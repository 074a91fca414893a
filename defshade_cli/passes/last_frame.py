"""What the frame that was drawn last leaves to the next one: its film, its shadow maps, a GBuffer of all it showed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.draw_list import DrawList
from defshade_cli.image.film import Film
from defshade_cli.passes.changed_parts import MOST_CHANGES, PART, ChangedPartsPass, parts_of
from defshade_cli.passes.changed_tiles import changed_tiles, part_around, worthwhile
from defshade_cli.passes.emitters import light_batches
from defshade_cli.passes.frame import Frame
from defshade_cli.passes.geometry import Geometry
from defshade_cli.passes.light_lists import TILE
from defshade_cli.passes.sampling import CENTRE
from defshade_cli.passes.screen import Drawn
from defshade_cli.passes.shadow_atlas import ShadowAtlas
from defshade_cli.passes.shadow_changes import MapChange, maps_that_change
from defshade_cli.passes.shadow_maps import MapRequest
from defshade_cli.passes.shadows import ShadowPass, ShadowVariant
from defshade_cli.passes.tables import TableStore
from defshade_cli.passes.tile_depths import TileDepths, boxes_at
from defshade_cli.passes.view import placement
from defshade_cli.plan import Plan
from defshade_cli.scene.scene import Scene

Parts = NDArray[np.bool_]
"""(R, C) rows and columns of the image's parts."""


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """Of an image, by the frame before. drawn: what is drawn anew, None for all.

    maps: of each batch of lights, those that are drawn already; none where they are to be drawn.
    """

    drawn: Drawn | None = None
    maps: Sequence[ShadowAtlas] = ()


NOTHING_KNOWN = Known()


class LastFrame:
    """Told of each frame that is drawn, and asked by the next."""

    def __init__(
        self,
        gpu: Gpu,
        frame: Frame,
        geometry: Geometry,
        tables: TableStore,
        shadow_pass: Callable[[ShadowVariant], ShadowPass],
    ) -> None:
        self._frame, self._depths, self._geometry = frame, TileDepths(gpu, frame), geometry
        self._tables, self._shadow_pass = tables, shadow_pass
        self._parts = cache(lambda *kind: ChangedPartsPass(gpu, *kind))
        self.forget()

    def forget(self) -> None:
        """The GBuffer holds something else from now on."""
        self._film: Film | None = None

    def keep(self, film: Film) -> None:
        """A frame that was drawn, of which the GBuffer has all."""
        self._film = film

    def compare(self, film: Film, draws: DrawList, scene: Scene, plan: Plan) -> Known:
        """What it leaves of the plan's image, by the plan's `redrawing`. film: of the frame that this is about."""
        tiles = changed_tiles(plan)
        if tiles is None or not plan.redrawing.by_maps:
            return Known(Drawn(tiles, TILE)) if tiles is not None else NOTHING_KNOWN
        redrawn = self._redraw_maps(draws, scene, plan) if film is self._film else None
        if redrawn is None:
            return NOTHING_KNOWN
        maps, changes = redrawn
        parts = worthwhile(self._shadowed_parts(changes, tiles, plan) | parts_of(tiles, plan.size))
        return Known(Drawn(parts, PART, part_around(tiles, plan.size)) if parts is not None else None, maps)

    def _redraw_maps(
        self, draws: DrawList, scene: Scene, plan: Plan
    ) -> tuple[list[ShadowAtlas], list[MapChange]] | None:
        """Of each batch of lights, and what changes in them; None where the last frame's are others."""
        assert plan.redrawing.boxes is not None
        tables, boxes = self._tables.update(plan), plan.redrawing.boxes - plan.camera.position
        shadow_pass = self._shadow_pass(ShadowVariant.of(draws, plan))
        maps, found = [], []
        for number, batch in enumerate(light_batches(scene, plan, CENTRE) if plan.lit else ()):
            redrawn = shadow_pass.redraw(draws, MapRequest.of(batch, plan, CENTRE, tables, number), boxes)
            if redrawn is None:
                return None
            maps.append(redrawn[0])
            found += redrawn[1]
        return maps, [change.all_behind() if plan.shadow_styles else change for change in found]

    def _shadowed_parts(self, changes: Sequence[MapChange], moved: NDArray[np.bool_], plan: Plan) -> Parts:
        """Those of tiles that are not `moved` (R, C), in which shadows may fall otherwise; by the GBuffer it left."""
        gbuffer = self._frame.gbuffer(plan.size, plan.planes, plan.layout)
        self._geometry.look(plan, gbuffer.layout)
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
