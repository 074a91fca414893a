"""A Scene's arrays in GPU buffers. What has not changed since the last frame is not uploaded again."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.records import record
from defshade_cli.gpu.textures import TextureSet, TextureStore, input_records
from defshade_cli.gpu.vertices import FEW_UV_SETS, in_slots, sets_of, uv_names, uv_slots, vertex_arrays
from defshade_cli.scene.geometry import Drawable, Mesh, box_corners
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.texture import Texture

(
    INSTANCES,
    MATERIALS,
    LIGHTS,
    LIGHT_LISTS,
    TEXTURE_INPUTS,
    TILES,
    LINKS,
    MOTIONS,
    BOXES,
    TRIANGLES,
    LAMPS,
    CELLS,
) = range(1, 13)
"""Binding points of the storage buffers, as the shaders declare them."""

LIGHT_BLOCK, SHADOW_BLOCK, VIEW_BLOCK = range(3)
"""Binding points of the uniform buffers."""

INDICES_IN_POOL = 2
"""Which of the vertex arrays has a row a triangle; the others have one a vertex."""

_COMMAND = np.dtype([(name, "u4") for name in ("count", "instances", "first_index", "base_vertex", "base_instance")])


_TURNS = 8

NO_TEXELS: Mapping[Texture, float] = MappingProxyType({})


class RecordBuffer:
    """A storage buffer of records at one binding, or a uniform one; it grows as it must.

    llvmpipe does not know which storage buffers its queued draws still read, so there a write goes to the next of a
    few, and waits for the draws once they have all been written.
    """

    def __init__(self, gpu: Gpu, binding: int, *, uniform: bool = False) -> None:
        self._gpu, self._binding, self._uniform = gpu, binding, uniform
        self._buffers = [gpu.keep(gpu.context.buffer(reserve=256)) for _ in range(_TURNS if gpu.is_software else 1)]
        self._turn = 0

    def write(self, records: NDArray[Any]) -> None:
        """Upload `records` (N,) and bind the buffer."""
        if self._gpu.is_software and self._turn == 0:
            self._gpu.context.finish()
        buffer, self._turn = self._buffers[self._turn], (self._turn + 1) % len(self._buffers)
        if records.nbytes > buffer.size:
            buffer.orphan(records.nbytes)
        buffer.write(np.ascontiguousarray(records))
        bind = buffer.bind_to_uniform_block if self._uniform else buffer.bind_to_storage_buffer
        bind(self._binding)


CASTER_FRONTS = 0, 1, -1
"""What DrawList.fronts may be."""


@dataclass(frozen=True, slots=True, eq=False)
class DrawList:
    """All opaque geometry as one multi-draw.

    vertices: (buffer, format, attribute names) triples as moderngl takes them; indices: 32-bit.
    table: (C,) indirect commands, one draw a subset, instanced.  thin: (C,) whose materials may let something through.
    fronts: (C,) of what is closed: 1 where fronts are counter-clockwise, −1 where its placements mirror them; else 0.
    corners: (C, 8, 3) of a box around what each command draws, relative to the eye; not finite where nothing is known.
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


class GpuScene:
    """Buffers for one scene after another, of the same Gpu."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._instances = RecordBuffer(gpu, INSTANCES)
        self._materials = RecordBuffer(gpu, MATERIALS)
        self._texture_inputs = RecordBuffer(gpu, TEXTURE_INPUTS)
        self._tiles = RecordBuffer(gpu, TILES)
        self._textures = TextureStore(gpu)
        self._meshes: tuple[Mesh, ...] = ()
        self._made_for: tuple[Any, ...] = ()
        self._pool: list[moderngl.Buffer] = []
        self._draws: list[moderngl.Buffer] = []
        self._moved: list[moderngl.Buffer] = []

    def update(
        self,
        scene: Scene,
        inputs: Collection[str] = (),
        moved: Sequence[NDArray[np.float32]] = (),
        primvars: tuple[str, ...] = (),
        texels: Mapping[Texture, float] = NO_TEXELS,
        thin: Sequence[int] = (),
        closed: Sequence[int] = (),
    ) -> DrawList:
        """Make the scene's geometry, placements and materials resident, relative to its camera.

        inputs: what layers read of the vertices, as gpu.planes.Plane.inputs names it.
        moved: (V, 3) points of all meshes a frame before and after, where MOTION is among them.
        primvars: names of those that layers show, at most MOST_PRIMVARS.
        texels: a side that textures are worth; those that it does not name are read whole.
        thin: numbers of the materials that may let something through.
        closed: numbers of the drawables of which maps need the fronts alone.
        """
        layer_uv = "LAYER_UV" in inputs
        instances = instance_records(scene.drawables, scene.camera.position)
        self._instances.write(instances)
        names_read = uv_names(scene.drawables, scene.materials, len(scene.meshes))
        slots = uv_slots(names_read)
        uvs, uv_sets = tuple(in_slots(names, slots) for names in names_read), sets_of(slots)
        textures = self._update_materials(scene, slots, texels)
        color_varies = any(m.display_color is not None or m.display_opacity is not None for m in scene.meshes)
        textured = bool(textures.arrays)
        made_for = (uvs if textured else (), color_varies, textured, layer_uv, primvars)
        arrays_of = partial(
            vertex_arrays, color_varies=color_varies, textured=textured, layer_uv=layer_uv, primvars=primvars
        )
        if made_for == self._made_for and _are_alike(self._meshes, scene.meshes):
            self._overwrite(scene.meshes, lambda number: arrays_of([scene.meshes[number]], uvs[number : number + 1]))
        else:
            self._pool = self._replaced(self._pool, arrays_of(scene.meshes, uvs))
        self._meshes, self._made_for = scene.meshes, made_for
        commands, rows = draw_commands(scene.drawables, scene.meshes)
        thin_commands = np.isin(rows[commands["base_instance"], 1], thin)
        numbers = [np.arange(len(rows), dtype=np.uint32)] * ("DRAW_ROW" in inputs)
        self._draws = self._replaced(self._draws, [rows, *numbers])
        positions, normals, indices, *varying = self._pool
        vertices = [(positions, "3f", "position_object"), (normals, "3f", "normal_object")]
        names = [("4f", "vertex_color")] * color_varies + [(f"{2 * uv_sets}f", "vertex_uv")] * textured
        names += [("2f", "vertex_layer_uv")] * layer_uv + [("16f", "vertex_primvars")] * bool(primvars)
        vertices += [(buffer, *name) for buffer, name in zip(varying, names, strict=True)]
        self._moved = self._replaced(self._moved, moved)
        moments = ("position_before", "position_after")[: len(moved)]
        vertices += [(buffer, "3f", name) for buffer, name in zip(self._moved, moments, strict=True)]
        vertices.append((self._draws[0], "2u4/i", "draw"))
        vertices += [(buffer, "1u4/i", "draw_row") for buffer in self._draws[1:]]
        corners = command_corners(scene)
        many_uvs = uv_sets > FEW_UV_SETS
        return DrawList(
            tuple(vertices),
            indices,
            commands,
            thin_commands,
            fronts_of(scene.drawables, instances["handedness"], closed),
            corners,
            color_varies=color_varies,
            textures=textures,
            many_uvs=many_uvs,
        )

    def _update_materials(self, scene: Scene, slots: Mapping[str, int], texels: Mapping[Texture, float]) -> TextureSet:
        textures = self._textures.update(scene.textures, texels)
        inputs, counts = input_records(scene.materials, textures, slots)
        self._materials.write(material_records(scene.materials, counts))
        if textures.arrays:
            self._texture_inputs.write(inputs)
            self._tiles.write(textures.tiles)
        return textures

    def _overwrite(self, meshes: tuple[Mesh, ...], arrays_of: Callable[[int], Iterable[NDArray[Any]]]) -> None:
        """Upload the meshes that are not the same as before, each to its place in the pool."""
        firsts = _first_rows(meshes)
        for number, (old, new) in enumerate(zip(self._meshes, meshes, strict=True)):
            if old is not new:
                for kind, (buffer, array) in enumerate(zip(self._pool, arrays_of(number), strict=True)):
                    row = firsts[number, 1 if kind == INDICES_IN_POOL else 0]
                    buffer.write(np.ascontiguousarray(array), offset=int(row) * array[:1].nbytes)

    def _replaced(self, old: list[moderngl.Buffer], arrays: Iterable[NDArray[Any]]) -> list[moderngl.Buffer]:
        for buffer in old:
            buffer.release()
        return [self._gpu.context.buffer(np.ascontiguousarray(a) if a.size else bytes(4)) for a in arrays]


def instance_records(drawables: Sequence[Drawable], eye: NDArray[np.float64]) -> NDArray[Any]:
    """One Instance record a placement (P,), in the drawables' order; differences taken in float64."""
    if not drawables:
        return np.zeros(0, record("Instance"))
    matrices = np.concatenate([d.world_from_object for d in drawables])
    records = np.zeros(len(matrices), record("Instance"))
    relative = matrices.copy()
    relative[:, :3, 3] -= eye
    records["relative_from_object"] = relative.transpose(0, 2, 1)
    normal, handedness = _normal_matrices(matrices[:, :3, :3])
    records["relative_from_normal"][:, :3, :3] = normal.transpose(0, 2, 1)
    records["handedness"] = handedness
    records["link_set"] = np.concatenate([d.link_sets for d in drawables])
    records["display_color"] = np.concatenate([d.display_color for d in drawables])
    records["display_opacity"] = np.concatenate([d.display_opacity for d in drawables])
    return records


def _normal_matrices(linear: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cofactors of unit size with the determinant's sign: an inverse transpose that no singular matrix breaks."""
    columns = (
        linear.transpose(0, 2, 1) / np.maximum(np.abs(linear).max(axis=(1, 2)), np.finfo(float).tiny)[:, None, None]
    )
    x, y, z = columns[:, 0], columns[:, 1], columns[:, 2]
    cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=-1)
    handedness = np.where(np.einsum("ni,ni->n", x, cofactors[..., 0]) < 0, -1.0, 1.0)
    size = np.maximum(np.abs(cofactors).max(axis=(1, 2)), np.finfo(float).tiny)
    return cofactors * (handedness / size)[:, None, None], handedness


def material_records(materials: Sequence[Material], input_counts: Sequence[int]) -> NDArray[Any]:
    """One Material record each, (M,); fields of the same name are copied. input_counts: texture inputs of each."""
    dtype = record("Material")
    records = np.zeros(len(materials), dtype)
    for name in sorted(set(dtype.names or ()) - {"first_input", "input_count"}):
        records[name] = [getattr(material, name) for material in materials]
    records["input_count"] = input_counts
    records["first_input"] = np.cumsum([0, *input_counts])[:-1]
    return records


def draw_commands(drawables: Sequence[Drawable], meshes: Sequence[Mesh]) -> tuple[NDArray[Any], NDArray[np.uint32]]:
    """Indirect commands (S,), one a subset, and the rows (R, 2), instance and material, that they point into."""
    base_vertex, base_index = (_first_rows(meshes) * (1, 3)).T
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


def _first_rows(meshes: Sequence[Mesh]) -> NDArray[np.int64]:
    """(M + 1, 2) vertices and triangles before each mesh, and all of them."""
    sizes = [(len(mesh.points), len(mesh.triangles)) for mesh in meshes]
    return np.cumsum([(0, 0), *sizes], axis=0, dtype=np.int64)


def _are_alike(old: tuple[Mesh, ...], new: tuple[Mesh, ...]) -> bool:
    """Do the meshes take the same places in the pool?"""
    return bool(old) and np.array_equal(_first_rows(old), _first_rows(new))
