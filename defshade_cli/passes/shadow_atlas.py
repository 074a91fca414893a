"""Where shadow maps lie in their atlas, and how the lighting's shaders find a place's texel: lib/shadow.glsl.

A light's single map has a ShadowMap record. Six faces of a cube need none: their sides lie along the axes, and all
cubes of an atlas share their window and their range of depth.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.buffers import SHADOW_BLOCK
from defshade_cli.gpu.records import block_source, record
from defshade_cli.gpu.shaders import set_uniforms
from defshade_cli.passes.view import clip_from_camera, depth_coefficients
from defshade_cli.plan.shadow_maps import ATLAS, CUBE_FACES
from defshade_cli.scene.camera import Camera
from defshade_cli.spaces import Matrix

ShadowKind = Literal["map", "cube"]

_MOST_RECORDS = 16384 // record("ShadowMap").itemsize  # of the smallest uniform block that OpenGL allows
_TOWARDS_LIGHT = 0.02
"""Of a texel, that receivers count as nearer: clears float32 rounding."""


class AtlasRoom:
    """What an atlas of maps of `resolution` texels a side still holds: slots, and records of single maps."""

    def __init__(self, resolution: int) -> None:
        self._slots, self._records = (ATLAS // resolution) ** 2, _MOST_RECORDS

    def holds(self, maps: int) -> bool:
        """A light with as many maps?"""
        return maps <= self._slots and (maps != 1 or self._records > 0)

    def take(self, maps: int) -> None:
        """Take room for a light with as many maps."""
        self._slots -= maps
        self._records -= maps == 1


def viewport(slot: int, resolution: int) -> tuple[int, int, int, int]:
    """Of a slot of the atlas, row by row; in texels."""
    row, column = divmod(slot, ATLAS // resolution)
    return column * resolution, row * resolution, resolution, resolution


def taken(maps: int, resolution: int) -> tuple[int, int]:
    """(width, height) of the first slots, as many as maps; in texels."""
    columns = ATLAS // resolution
    return min(maps, columns) * resolution, -(-maps // columns) * resolution


def shadow_source(kinds: Sequence[ShadowKind]) -> dict[str, str]:
    """What lib/shadow.glsl includes."""
    block = block_source("ShadowMap", _MOST_RECORDS, SHADOW_BLOCK) if "map" in kinds else ""
    return {"generated/shadow_maps.glsl": f"const float ATLAS = {ATLAS}.0;\n{block}"}


def kind_of(maps: int) -> tuple[ShadowKind, ...]:
    """Of a light with as many maps."""
    return () if maps == 0 else ("map",) if maps == 1 else ("cube",)


@dataclass(frozen=True, slots=True, eq=False)
class ShadowAtlas:
    """The maps of some lights. first, count: (L,) of each light, in the order they were given.

    rows_used: of its texels.  first_record: (L,) of those that have a single map.  records: of these.
    uniforms: what the shaders read of cubes.
    """

    depth: moderngl.Texture
    first: NDArray[np.uint32]
    count: NDArray[np.uint32]
    rows_used: int
    first_record: NDArray[np.uint32]
    records: NDArray[Any]
    uniforms: Mapping[str, tuple[Any, ...]]

    @property
    def texels_used(self) -> int:
        """Of all maps."""
        return self.rows_used * ATLAS

    def part(self, lights: slice | NDArray[np.intp]) -> ShadowAtlas:
        """The same for some of its lights."""
        first, count, record = (row[lights] for row in (self.first, self.count, self.first_record))
        return replace(self, first=first, count=count, first_record=record)

    def bind(self, program: moderngl.Program) -> moderngl.Texture:
        """Let `program` find texels; returns what holds them."""
        set_uniforms(program, self.uniforms)
        return self.depth


def placed(cameras: Sequence[tuple[Camera, ...]], resolution: int, jitter: tuple[float, float]) -> list[Camera]:
    """All maps' cameras, light by light, each moved by `jitter` texels; cubes with a range of depth in common."""
    maps = [(camera, len(light) == CUBE_FACES) for light in cameras for camera in light]
    farthest = max((camera.clipping_range for camera, is_face in maps if is_face), default=(0.0, 0.0))
    shared = [replace(camera, clipping_range=farthest) if is_face else camera for camera, is_face in maps]
    return [_moved(camera, resolution, jitter) for camera in shared]


def _moved(camera: Camera, resolution: int, jitter: tuple[float, float]) -> Camera:
    left, right, bottom, top = camera.window
    dx, dy = jitter[0] * (right - left) / resolution, jitter[1] * (top - bottom) / resolution
    return replace(camera, window=(left + dx, right + dx, bottom + dy, top + dy))


def places_from_relative(camera: Camera, resolution: int) -> Matrix:
    """(4, 4) what finds a receiver in its map: texels and stored depth, times w."""
    return _atlas_from_clip(0, 0, resolution) @ _nearer(camera, resolution) @ camera.camera_from_world


def clip_from_relative(camera: Camera) -> Matrix:
    """(4, 4) what draws a map."""
    return _projection(camera) @ camera.camera_from_world


def _projection(camera: Camera) -> Matrix:
    return clip_from_camera(camera, camera.window, camera.clipping_range, standard=False)


def map_records(maps: Sequence[Camera], slots: Sequence[int], resolution: int) -> NDArray[Any]:
    """ShadowMap records (N,) of those of `maps` that are in `slots`; as many as the shaders' block has."""
    records = np.zeros(_MOST_RECORDS, record("ShadowMap"))
    for row, slot in zip(records, slots, strict=False):
        x, y = viewport(slot, resolution)[:2]
        matrix = _atlas_from_clip(x, y, resolution) @ _nearer(maps[slot], resolution) @ maps[slot].camera_from_world
        row["x"], row["y"], row["z"], row["w"] = matrix
        row["least"], row["side"] = (x, y), resolution
        row["depth_coefficients"] = depth_coefficients(maps[slot], maps[slot].clipping_range, standard=False)
    return records


def cube_uniforms(face: Camera, resolution: int) -> dict[str, tuple[Any, ...]]:
    """Of all cubes of an atlas, by any of their faces."""
    matrix = _atlas_from_clip(0, 0, resolution) @ _nearer(face, resolution)
    return {
        "cube_window": (matrix[0, 0], matrix[1, 1], -matrix[0, 2], -matrix[1, 2]),
        "cube_depth": (matrix[2, 3], -matrix[2, 2]),
        "cube_coefficients": depth_coefficients(face, face.clipping_range, standard=False),
        "atlas_grid": (int(math.log2(ATLAS // resolution)), int(math.log2(resolution))),
    }


def _atlas_from_clip(x: int, y: int, resolution: int) -> Matrix:
    """To texels times w, of a map that begins at a texel; rows of images point down."""
    half = 0.5 * resolution
    matrix = np.diag([half, -half, 1.0, 1.0])
    matrix[:2, 3] = x + half, y + half
    return matrix


def deeper_from_relative(camera: Camera, resolution: int, texels: float) -> Matrix:
    """(4, 4) what draws a map of things that are farther from the light by some of its texels' lesser sides."""
    left, right, bottom, top = camera.window
    return _nearer_by(camera, -texels * min(right - left, top - bottom) / resolution) @ camera.camera_from_world


def _nearer(camera: Camera, resolution: int) -> Matrix:
    """The projection of receivers, nearer to the light than they are."""
    left, right, bottom, top = camera.window
    return _nearer_by(camera, _TOWARDS_LIGHT * max(right - left, top - bottom) / resolution)


def _nearer_by(camera: Camera, step: float) -> Matrix:
    """The projection of what is nearer by a step; where the view widens, by as much a unit ahead."""
    matrix = _projection(camera)
    matrix[2, 3] += step * (matrix[2, 3] if camera.projection == "perspective" else matrix[2, 2])
    return matrix
