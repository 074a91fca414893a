"""A Scene's arrays in GPU buffers. What has not changed since the last frame is not uploaded again."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from types import MappingProxyType

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.buffers import INSTANCES, MATERIALS, TEXTURE_INPUTS, TILES, RecordBuffer, replaced
from defshade_cli.gpu.coarse_casters import CoarseCasters, CoarseTriangles
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.draw_list import DrawList, command_corners, draw_commands, fronts_of
from defshade_cli.gpu.scene_records import instance_records, material_records
from defshade_cli.gpu.textures import TextureSet, TextureStore, input_records
from defshade_cli.gpu.vertex_pool import Attributes, VertexPool
from defshade_cli.gpu.vertices import FEW_UV_SETS, Varying, in_slots, sets_of, uv_names, uv_slots
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.texture import Texture

NO_TEXELS: Mapping[Texture, float] = MappingProxyType({})


class GpuScene:
    """Buffers for one scene after another, of the same Gpu."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._instances = RecordBuffer(gpu, INSTANCES)
        self._materials = RecordBuffer(gpu, MATERIALS)
        self._texture_inputs = RecordBuffer(gpu, TEXTURE_INPUTS)
        self._tiles = RecordBuffer(gpu, TILES)
        self._textures, self._pool = TextureStore(gpu), VertexPool(gpu)
        self._coarse = CoarseTriangles(gpu)
        self._rows: list[moderngl.Buffer] = []
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
        coarse: Sequence[int] = (),
    ) -> DrawList:
        """Make the scene's geometry, placements and materials resident, relative to its camera.

        inputs: what layers read of the vertices, as gpu.planes.Plane.inputs names it.
        moved: (V, 3) points of all meshes a frame before and after, where MOTION is among them.
        primvars: names of those that layers show, at most MOST_PRIMVARS.
        texels: a side that textures are worth; those that it does not name are read whole.
        thin: numbers of the materials that may let something through.
        closed: numbers of the drawables of which maps need the fronts alone.
        coarse: numbers of those that coarser triangles may stand for in maps.
        """
        instances = instance_records(scene.drawables, scene.camera.position)
        self._instances.write(instances)
        names = uv_names(scene.drawables, scene.materials, len(scene.meshes))
        slots = uv_slots(names)
        textures = self._update_materials(scene, slots, texels)
        varying = Varying(
            color_varies=any(m.display_color is not None or m.display_opacity is not None for m in scene.meshes),
            uv_sets=sets_of(slots) if textures.arrays else 0,
            layer_uv="LAYER_UV" in inputs,
            primvars=primvars,
        )
        vertices, indices = self._pool.update(scene.meshes, tuple(in_slots(read, slots) for read in names), varying)
        commands, rows = draw_commands(scene.drawables, scene.meshes)
        return DrawList(
            (*vertices, *self._update_moved(moved), *self._update_rows(rows, numbered="DRAW_ROW" in inputs)),
            indices,
            commands,
            np.isin(rows[commands["base_instance"], 1], thin),
            fronts_of(scene.drawables, instances["handedness"], closed),
            command_corners(scene),
            color_varies=varying.color_varies,
            textures=textures,
            coarse=CoarseCasters.of_scene(scene, coarse, self._coarse),
            many_uvs=varying.uv_sets > FEW_UV_SETS,
        )

    def _update_materials(self, scene: Scene, slots: Mapping[str, int], texels: Mapping[Texture, float]) -> TextureSet:
        textures = self._textures.update(scene.textures, texels)
        inputs, counts = input_records(scene.materials, textures, slots)
        self._materials.write(material_records(scene.materials, counts))
        if textures.arrays:
            self._texture_inputs.write(inputs)
            self._tiles.write(textures.tiles)
        return textures

    def _update_moved(self, moved: Sequence[NDArray[np.float32]]) -> Iterable[Attributes]:
        self._moved = replaced(self._gpu, self._moved, moved)
        names = ("position_before", "position_after")[: len(moved)]
        return [(buffer, "3f", name) for buffer, name in zip(self._moved, names, strict=True)]

    def _update_rows(self, rows: NDArray[np.uint32], *, numbered: bool) -> Iterable[Attributes]:
        """What commands point into. numbered: with the number of each."""
        numbers = [np.arange(len(rows), dtype=np.uint32)] * numbered
        self._rows = replaced(self._gpu, self._rows, [rows, *numbers])
        names = (("2u4/i", "draw"), ("1u4/i", "draw_row"))[: len(self._rows)]
        return [(buffer, *name) for buffer, name in zip(self._rows, names, strict=True)]
