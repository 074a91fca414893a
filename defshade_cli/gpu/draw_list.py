"""What is drawn: all geometry as one multi-draw, a command a subset of a drawable."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.coarse_casters import CoarseCasters
from defshade_cli.gpu.textures import TextureSet
from defshade_cli.gpu.vertex_pool import first_rows
from defshade_cli.scene.geometry import Drawable, Mesh, box_corners
from defshade_cli.scene.scene import Scene

_COMMAND = np.dtype([(name, "u4") for name in ("count", "instances", "first_index", "base_vertex", "base_instance")])

CASTER_FRONTS = 0, 1, -1
"""What DrawList.fronts may be."""


@dataclass(frozen=True, slots=True, eq=False)
class DrawList:
    """All opaque geometry as one multi-draw.

    vertices: (buffer, format, attribute names) triples as moderngl takes them; indices: 32-bit.
    table: (C,) indirect commands, one draw a subset, instanced.  thin: (C,) whose materials may let something through.
    fronts: (C,) of what is closed: 1 where fronts are counter-clockwise, −1 where its placements mirror them; else 0.
    corners: (C, 8, 3) of a box around what each command draws, relative to the eye; not finite where nothing is known.
    coarse: what coarser triangles may stand for in shadow maps.
    many_uvs: vertices hold UV_SETS sets of texture coordinates, not FEW_UV_SETS.
    """

    vertices: tuple[tuple[Any, ...], ...]
    indices: moderngl.Buffer
    table: NDArray[Any]
    thin: NDArray[np.bool_]
    fronts: NDArray[np.int8]
    corners: NDArray[np.float64]
    color_varies: bool
    textures: TextureSet
    coarse: CoarseCasters
    many_uvs: bool

    def vertices_of(self, program: moderngl.Program) -> list[tuple[Any, ...]]:
        """Those of `vertices` that the program reads."""
        return [part for part in self.vertices if any(name in program for name in part[2:])]

    def runs(self, seen: NDArray[np.bool_]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Of the (C,) commands that are seen, the solid ones and the thin ones."""
        return self.table[seen & ~self.thin], self.table[seen & self.thin]

    def caster_runs(self, seen: NDArray[np.bool_], fronts: NDArray[np.int8]) -> list[NDArray[Any]]:
        """The same, those that are solid apart by CASTER_FRONTS. fronts: (C,), 0 too where a light may be within."""
        solid = seen & ~self.thin
        return [*(self.table[solid & (fronts == side)] for side in CASTER_FRONTS), self.table[seen & self.thin]]

    @property
    def texture_groups(self) -> int:
        """Samplers that a program needs for the textures; 0 where there are none."""
        return len(self.textures.arrays)


def draw_commands(drawables: Sequence[Drawable], meshes: Sequence[Mesh]) -> tuple[NDArray[Any], NDArray[np.uint32]]:
    """Indirect commands (S,), one a subset, and the rows (R, 2), instance and material, that they point into."""
    base_vertex, base_index = (first_rows(meshes) * (1, 3)).T
    commands, rows, first_instance, first_row = [], [], 0, 0
    for drawable in drawables:
        count = len(drawable.world_from_object)
        for subset in drawable.subsets:
            first_index = base_index[drawable.mesh] + 3 * subset.first
            commands.append((3 * subset.count, count, first_index, base_vertex[drawable.mesh], first_row))
            instances = np.arange(first_instance, first_instance + count, dtype=np.uint32)
            rows.append(np.column_stack([instances, np.full(count, subset.material, np.uint32)]))
            first_row += count
        first_instance += count
    return np.array(commands, _COMMAND), np.concatenate(rows) if rows else np.empty((0, 2), np.uint32)


def fronts_of(
    drawables: Sequence[Drawable], handedness: NDArray[np.float32], closed: Sequence[int]
) -> NDArray[np.int8]:
    """(C,) of each command, as DrawList.fronts; handedness: (P,) of all placements."""
    fronts = np.zeros(len(drawables), np.int8)
    ends = np.cumsum([0, *(len(drawable.world_from_object) for drawable in drawables)])
    for number in closed:
        sides = handedness[ends[number] : ends[number + 1]]
        if len(sides) and (sides == sides[0]).all():
            fronts[number] = sides[0]
    return np.repeat(fronts, [len(drawable.subsets) for drawable in drawables])


def command_corners(scene: Scene) -> NDArray[np.float64]:
    """(C, 8, 3) of the box around each command's drawable, relative to the camera."""
    counts = [len(drawable.subsets) for drawable in scene.drawables]
    return np.repeat(box_corners(scene.drawable_bounds - scene.camera.position), counts, axis=0)
