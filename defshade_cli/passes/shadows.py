"""Shadow maps: the scene as one sample of each light sees it, side by side in an atlas.

A light that has all geometry in front of it gets one map, fitted to the geometry or to its cone; a light amid it gets
the six faces of a cube. Maps are moved by a fraction of a texel every sample, so that their grid averages out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.records import record
from defshade_cli.gpu.render_space import space_defines
from defshade_cli.gpu.residence import SHADOW_MAPS, DrawList, RecordBuffer
from defshade_cli.gpu.textures import textures_source
from defshade_cli.image.render_space import REC709, RenderSpace
from defshade_cli.passes.culling import CommandBuffer, may_see
from defshade_cli.passes.view import clip_from_camera, depth_coefficients
from defshade_cli.scene.camera import Camera, Projection
from defshade_cli.scene.emission import Emitter
from defshade_cli.scene.light import Shaping
from defshade_cli.spaces import Matrix, Window, frame_along, transform_points

RESOLUTION = 1024
TILES = 4
CAPACITY = TILES * TILES
"""Shadow maps that one atlas holds."""

_WIDEST_DEGREES = 60.0
_NO_WINDOW: Window = (-1.0, 1.0, -1.0, 1.0)
_NEAREST = 1e-4  # near plane over far plane, where nothing else bounds it
_DEPTH_OFFSET = (-2.0, -1.0)
"""Of what a map stores, in slopes a texel and in steps of depth: at the four texels around a receiver a flat surface is
up to |∂z/∂x| + |∂z/∂y| nearer. An offset along the light moves no shadow's edge, as one of the receiver would."""

_FACES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.float64)
_FACE_FRAMES = tuple(frame_along(-face) for face in _FACES)


@dataclass(frozen=True, slots=True, eq=False)
class ShadowExtent:
    """What the maps must see, as boxes of eight corners (8, 3) relative to the eye.

    receivers: around what the image may show; casters: around all geometry.
    """

    receivers: NDArray[np.float64]
    casters: NDArray[np.float64]


def shadow_cameras(
    emitter: Emitter, shaping: Shaping | None, extent: ShadowExtent, *, distant: bool
) -> tuple[Camera, ...]:
    """The maps' cameras: one, or the six of a cube in the shader's order; the emitter is relative to the eye."""
    if distant:
        return (_parallel(emitter.axis, extent),)
    far = float(np.linalg.norm(extent.receivers - emitter.position, axis=1).max()) * 1.001
    fitted = [_around_cone(emitter, shaping, far), _around_receivers(emitter.position, extent, far)]
    cameras = [camera for camera in fitted if camera is not None]
    return (min(cameras, key=_opening),) if cameras else _cube(emitter.position, far)


def _parallel(axis: NDArray[np.float64], extent: ShadowExtent) -> Camera:
    centre = extent.receivers.mean(axis=0)
    camera_from_world = _looking(centre, axis, _NO_WINDOW, (0, 0)).camera_from_world
    seen = transform_points(camera_from_world, extent.receivers)
    depth = -transform_points(camera_from_world, np.concatenate([extent.receivers, extent.casters]))[:, 2]
    margin = 4.0 / RESOLUTION * float(np.ptp(seen, axis=0).max()) + 1e-12
    low, high = seen.min(axis=0) - margin, seen.max(axis=0) + margin
    clip = (depth.min() - margin, depth.max() + margin)
    return _looking(centre, axis, (low[0], high[0], low[1], high[1]), clip, "orthographic")


def _around_cone(emitter: Emitter, shaping: Shaping | None, far: float) -> Camera | None:
    if shaping is None or shaping.cone_angle > _WIDEST_DEGREES:
        return None
    side = math.tan(math.radians(max(shaping.cone_angle, 0.01))) * (1.0 + 4.0 / RESOLUTION)
    return _looking(emitter.position, emitter.axis, (-side, side, -side, side), (_NEAREST * far, far))


def _around_receivers(position: NDArray[np.float64], extent: ShadowExtent, far: float) -> Camera | None:
    """A map that sees all receivers; None where that is too wide, or the position is amid them."""
    direction = extent.receivers.mean(axis=0) - position
    if not direction.any():
        return None
    camera_from_world = _looking(position, direction, _NO_WINDOW, (0, 0)).camera_from_world
    seen = transform_points(camera_from_world, extent.receivers)
    depth = -seen[:, 2:]
    if depth.min() <= _NEAREST * depth.max():
        return None
    low, high = (seen[:, :2] / depth).min(axis=0), (seen[:, :2] / depth).max(axis=0)
    if max(np.abs(low).max(), np.abs(high).max()) > math.tan(math.radians(_WIDEST_DEGREES)):
        return None
    margin = 4.0 / RESOLUTION * (high - low) + 1e-9
    (left, bottom), (right, top) = low - margin, high + margin
    casters = -transform_points(camera_from_world, extent.casters)[:, 2]
    near = max(0.999 * float(min(casters.min(), depth.min())), _NEAREST * far)
    return _looking(position, direction, (left, right, bottom, top), (near, far))


def _cube(position: NDArray[np.float64], far: float) -> tuple[Camera, ...]:
    side = 1.0 + 4.0 / RESOLUTION  # room for the jitter, so that the faces still meet
    window = (-side, side, -side, side)
    return tuple(_framed(position, frame, window, (_NEAREST * far, far)) for frame in _FACE_FRAMES)


def _opening(camera: Camera) -> float:
    left, right, bottom, top = camera.window
    return (right - left) * (top - bottom)


def _looking(
    position: NDArray[np.float64],
    direction: NDArray[np.float64],
    window: Window,
    clip: tuple[float, float],
    projection: Projection = "perspective",
) -> Camera:
    return _framed(position, frame_along(-np.asarray(direction)), window, clip, projection)


def _framed(
    position: NDArray[np.float64],
    rotation: NDArray[np.float64],
    window: Window,
    clip: tuple[float, float],
    projection: Projection = "perspective",
) -> Camera:
    frame: Matrix = np.eye(4)
    frame[:3, :3] = rotation
    frame[:3, 3] = position
    return Camera("<shadow>", frame, window, projection, clip)


@dataclass(frozen=True, slots=True, eq=False)
class ShadowAtlas:
    """The maps of some lights. first, count: (L,) of each light, in the order they were given."""

    depth: moderngl.Texture
    first: NDArray[np.uint32]
    count: NDArray[np.uint32]


@dataclass(frozen=True, slots=True)
class ShadowVariant:
    """What the pass is compiled for: the terms of GBufferVariant. linked: a light chooses its casters."""

    cutout: bool
    transparent: bool
    color_varies: bool
    texture_groups: int
    linked: bool
    space: RenderSpace = REC709
    many_uvs: bool = False

    @property
    def defines(self) -> list[str]:
        read = ["TRANSPARENT"] * self.transparent + ["DISPLAY_COLOR_VARIES"] * self.color_varies
        read += ["TEXTURES"] * bool(self.texture_groups) + ["MANY_UVS"] * self.many_uvs + space_defines(self.space)
        return (["CUTOUT", *read] if self.cutout else []) + ["LINKS"] * self.linked


class ShadowPass:
    """Draws shadow maps into an atlas of CAPACITY tiles; what one call draws the next overwrites."""

    def __init__(self, gpu: Gpu, variant: ShadowVariant) -> None:
        generated = {"generated/textures.glsl": textures_source(variant.texture_groups)}
        size = (TILES * RESOLUTION, TILES * RESOLUTION)
        self._context = gpu.context
        kinds = [replace(variant, cutout=False), variant][: 1 + variant.cutout]
        self._programs = [
            gpu.shaders.program("shadow.vert", "shadow.frag", defines=kind.defines, generated=generated)
            for kind in kinds
        ]
        self._depth = gpu.keep(gpu.depth_texture(size))
        self._framebuffer = gpu.keep(gpu.context.framebuffer([], self._depth))
        self._maps = RecordBuffer(gpu, SHADOW_MAPS)
        self._commands = CommandBuffer(gpu)

    def draw(
        self,
        draws: DrawList,
        cameras: Sequence[tuple[Camera, ...]],
        jitter: tuple[float, float],
        casters: Sequence[int] = (),
    ) -> ShadowAtlas:
        """The maps of each light's cameras, at most CAPACITY in all; a light may have none.

        jitter: in texels.  casters: of each light, the place of its casters' link bits; all cast where none are given.
        """
        count = np.array([len(c) for c in cameras], np.uint32)
        first = np.concatenate([[0], np.cumsum(count)[:-1]]).astype(np.uint32)
        maps = [camera for light in cameras for camera in light]
        assert len(maps) <= CAPACITY
        self._framebuffer.use()
        if maps:
            columns, rows = min(len(maps), TILES), -(-len(maps) // TILES)
            self._framebuffer.clear(depth=0.0, viewport=(0, 0, columns * RESOLUTION, rows * RESOLUTION))
            records = np.zeros(len(maps), record("ShadowMap"))
            for tile, camera in enumerate(maps):
                records[tile] = _map_record(camera, tile, jitter)
            self._draw_maps(draws, maps, records, np.repeat(casters, count) if len(casters) else np.array([]))
        return ShadowAtlas(self._depth, first, count)

    def _draw_maps(self, draws: DrawList, maps: Sequence[Camera], records: NDArray, casters: NDArray) -> None:
        """Each map with the commands that it may see, those first that let nothing through."""
        kinds = len(self._programs)
        seen = [may_see(m, draws.corners) for m in records["clip_from_relative"]]
        self._commands.write([run for mask in seen for run in draws.runs(mask)[:kinds]])
        self._context.enable_only(moderngl.DEPTH_TEST)
        self._context.depth_func = ">"
        self._context.polygon_offset = _DEPTH_OFFSET
        for kind, program in enumerate(self._programs):
            array = self._context.vertex_array(program, draws.vertices_of(program), draws.indices)
            for tile, row in enumerate(records):
                x, y = tile % TILES, tile // TILES
                self._framebuffer.viewport = (x * RESOLUTION, y * RESOLUTION, RESOLUTION, RESOLUTION)
                program["clip_from_relative"] = tuple(row["clip_from_relative"].ravel().tolist())
                if "towards_light" in program:
                    program["towards_light"] = _towards(maps[tile])
                if "first_caster" in program:
                    program["first_caster"] = int(casters[tile])
                self._commands.render(array, tile * kinds + kind)
            array.release()
        self._context.polygon_offset = 0.0, 0.0
        self._maps.write(records)


def _towards(camera: Camera) -> tuple[float, ...]:
    """The light of a map: (position, 1), or (direction, 0) of one that is far away."""
    distant = camera.projection == "orthographic"
    return (*camera.world_from_camera[:3, 2 if distant else 3].tolist(), 0.0 if distant else 1.0)


def _map_record(camera: Camera, tile: int, jitter: tuple[float, float]) -> NDArray:
    """The ShadowMap of a tile, its camera's window moved by `jitter`."""
    left, right, bottom, top = camera.window
    texel = ((right - left) / RESOLUTION, (top - bottom) / RESOLUTION)
    dx, dy = jitter[0] * texel[0], jitter[1] * texel[1]
    window = left + dx, right + dx, bottom + dy, top + dy
    clip_from_light = clip_from_camera(camera, window, camera.clipping_range, standard=False)
    row = np.zeros((), record("ShadowMap"))
    row["clip_from_relative"] = (clip_from_light @ camera.camera_from_world).T
    row["tile"] = (tile % TILES / TILES, tile // TILES / TILES, 1 / TILES, 1 / TILES)
    row["texel"], row["resolution"] = max(texel), RESOLUTION
    row["depth_coefficients"] = depth_coefficients(camera, camera.clipping_range, standard=False)
    return row
