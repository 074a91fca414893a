"""Shadow maps as they are asked for, and what holds them from one frame to the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.draw_list import DrawList
from defshade_cli.gpu.targets import Part
from defshade_cli.passes.coarse_maps import coarse_levels
from defshade_cli.passes.culling import clip_of_part
from defshade_cli.passes.emitters import LitSample
from defshade_cli.passes.linking import ALL_LINKED
from defshade_cli.passes.sampling import Sample
from defshade_cli.passes.shadow_atlas import (
    ShadowAtlas,
    clip_from_relative,
    cube_uniforms,
    deeper_from_relative,
    map_records,
    placed,
    taken,
    viewport,
)
from defshade_cli.passes.shadow_changes import Region
from defshade_cli.passes.tables import LightTables
from defshade_cli.plan import Plan
from defshade_cli.plan.shadow_maps import ATLAS, CUBE_FACES
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.window import WHOLE_IMAGE


@dataclass(frozen=True, slots=True, eq=False)
class MapRequest:
    """Shadow maps that are drawn together.

    cameras: of each light, no more maps than the atlas holds; a light may have none.
    resolution: texels along a map's side.  jitter: in texels.
    casters: of each light, the place of its casters' link bits; all cast where none are given.
    number: of the atlas.
    coarse_share: of a texel, that coarser casters may be off; none are where it is 0.
    """

    cameras: Sequence[tuple[Camera, ...]]
    resolution: int
    jitter: tuple[float, float] = (0.0, 0.0)
    casters: Sequence[int] = ()
    number: int = 0
    coarse_share: float = 0.0

    @classmethod
    def of(cls, batch: Sequence[LitSample], plan: Plan, sample: Sample, tables: LightTables, number: int) -> MapRequest:
        """For the number-th batch of lights; where the next frame may keep its maps, an atlas of its own."""
        return cls(
            [lit.shadow_cameras for lit in batch],
            plan.shadow_resolution,
            sample.texel_offset,
            [tables.links.casts.get(lit.planned.light, ALL_LINKED) for lit in batch],
            number if plan.keeps_maps else 0,
            plan.coarse_share,
        )

    @property
    def count(self) -> NDArray[np.uint32]:
        """(L,) maps of each light."""
        return np.array([len(light) for light in self.cameras], np.uint32)


@dataclass(frozen=True, slots=True, eq=False)
class Maps:
    """The maps of an atlas, slot by slot.

    clips: (4, 4) each, transposed.  casters: empty where all cast.
    coarse_share: as in MapRequest.  levels: (M, D) how coarse each map takes its coarser casters.
    """

    cameras: Sequence[Camera]
    clips: Sequence[NDArray[np.float32]]
    casters: NDArray[Any]
    resolution: int
    coarse_share: float
    levels: NDArray[np.float64]

    @classmethod
    def of(cls, request: MapRequest, draws: DrawList) -> Maps:
        """What a request asks for."""
        side, share = request.resolution, request.coarse_share
        cameras = placed(request.cameras, side, request.jitter)
        clips = [clip_from_relative(camera).T.astype(np.float32) for camera in cameras]
        casters = np.repeat(request.casters, request.count) if len(request.casters) else np.array([])
        return cls(cameras, clips, casters, side, share, coarse_levels(draws, cameras, side, share))

    def are_alike(self, others: Maps | None) -> bool:
        """Do they see the same geometry alike?"""
        if others is None or (self.resolution, len(self.clips)) != (others.resolution, len(others.clips)):
            return False
        alike = all(np.array_equal(a, b) for a, b in zip(self.clips, others.clips, strict=True))
        as_coarse = np.array_equal(self.levels, others.levels)
        return alike and as_coarse and np.array_equal(self.casters, others.casters)

    def deeper(self, slot: int) -> NDArray[np.float32]:
        """(4, 4), transposed: as `clips`, for coarser casters."""
        return deeper_from_relative(self.cameras[slot], self.resolution, self.coarse_share).T.astype(np.float32)

    def clip_of(self, slot: int, region: Region | None) -> NDArray[np.floating]:
        """(4, 4), transposed: what sees a part of a map, or all of it."""
        if region is None:
            return self.clips[slot]
        x, y, width, height = (length / self.resolution for length in region)
        part: Part = (x, y, x + width, y + height)
        return self.clips[slot] if part == WHOLE_IMAGE else clip_of_part(self.clips[slot], part)


class MapTarget:
    """An atlas that is drawn into.  maps: what it holds."""

    def __init__(self, gpu: Gpu) -> None:
        self.depth = gpu.keep(gpu.depth_texture((ATLAS, ATLAS)))
        self._framebuffer = gpu.keep(gpu.context.framebuffer([], self.depth))
        self.maps: Maps | None = None

    def begin(self, maps: Maps) -> None:
        """Empty ones in place of what it holds."""
        self.maps = maps
        self._framebuffer.use()
        if maps.cameras:
            self._framebuffer.clear(depth=0.0, viewport=(0, 0, *taken(len(maps.cameras), maps.resolution)))

    def keep_to(self, slot: int, region: Region | None) -> None:
        """Draw a map, or a part of it, from now on."""
        assert self.maps
        framebuffer: Any = self._framebuffer  # moderngl's own types know no None
        framebuffer.viewport = viewport(slot, self.maps.resolution)
        framebuffer.scissor = self._place(slot, region) if region else None

    def empty(self, slot: int, region: Region) -> None:
        """Nothing is seen in a part of a map."""
        self._framebuffer.clear(depth=0.0, viewport=self._place(slot, region))

    def read(self, slot: int, region: Region) -> NDArray[np.float32]:
        """(height, width) depths of a part of a map, as stored."""
        place = self._place(slot, region)
        data = self._framebuffer.read(viewport=place, components=1, attachment=-1, dtype="f4", alignment=1)
        return np.frombuffer(data, np.float32).reshape(place[3], place[2])

    def use(self) -> None:
        """Draw into it."""
        self._framebuffer.use()

    def _place(self, slot: int, region: Region) -> Region:
        assert self.maps
        x, y, _, _ = viewport(slot, self.maps.resolution)
        return x + region[0], y + region[1], region[2], region[3]


def shadow_atlas(target: MapTarget, request: MapRequest) -> ShadowAtlas:
    """What a target holds of a request, as the lighting reads it."""
    assert target.maps
    maps, count, side = target.maps.cameras, request.count, request.resolution
    first = np.concatenate([[0], np.cumsum(count)[:-1]]).astype(np.uint32)
    cubes = first[count == CUBE_FACES]
    return ShadowAtlas(
        target.depth,
        first,
        count,
        rows_used=taken(len(maps), side)[1],
        first_record=(np.cumsum(count == 1) - 1).astype(np.uint32),
        records=map_records(maps, first[count == 1].tolist(), side),
        uniforms=cube_uniforms(maps[cubes[0]], side) if len(cubes) else {},
    )
