"""Vertex arrays of all meshes, one after another."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.planes import MOST_PRIMVARS
from defshade_cli.scene.geometry import Drawable, Mesh
from defshade_cli.scene.material import UV_SETS, Material

log = logging.getLogger("defshade")

UvNames = tuple[str, ...]

FEW_UV_SETS = 2
"""That nearly all scenes get by with."""


def uv_names(drawables: Sequence[Drawable], materials: Sequence[Material], count: int) -> tuple[UvNames, ...]:
    """For each of `count` meshes the primvars that its materials read, each once."""
    names: list[dict[str, None]] = [{} for _ in range(count)]
    for drawable in drawables:
        for subset in drawable.subsets:
            names[drawable.mesh].update(dict.fromkeys(materials[subset.material].uv_names[:UV_SETS]))
    return tuple(tuple(found) for found in names)


def uv_slots(names: Sequence[UvNames]) -> dict[str, int]:
    """Which set each primvar fills, the same on all meshes: another one than those that share a mesh with it.

    One for which no set is left is missing; what reads it keeps its constant.
    """
    slots: dict[str, int] = {}
    for name in dict.fromkeys(name for found in names for name in found):
        beside = {other for found in names if name in found for other in found}
        free = set(range(UV_SETS)) - {slots[other] for other in beside if other in slots}
        if free:
            slots[name] = min(free)
        else:
            log.warning("texture coordinates %s are not read: a mesh holds %d sets", name, UV_SETS)
    return slots


def sets_of(slots: Mapping[str, int]) -> int:
    """How many sets each vertex has: FEW_UV_SETS, or all where some mesh needs more."""
    return UV_SETS if max(slots.values(), default=0) >= FEW_UV_SETS else FEW_UV_SETS


def in_slots(names: UvNames, slots: Mapping[str, int]) -> UvNames:
    """What fills each set of a mesh; empty for nothing."""
    filled = {slots[name]: name for name in names if name in slots}
    return tuple(filled.get(slot, "") for slot in range(sets_of(slots)))


@dataclass(frozen=True, slots=True)
class Varying:
    """What vertices have beside their points and normals.

    uv_sets: of texture coordinates; 0 without textures.  layer_uv: a layer shows some.
    primvars: names of those that layers show, at most MOST_PRIMVARS.
    """

    color_varies: bool
    uv_sets: int
    layer_uv: bool
    primvars: tuple[str, ...]

    @property
    def attributes(self) -> list[tuple[str, str]]:
        """The format of each, and its name in the shaders."""
        found = [("4f", "vertex_color")] * self.color_varies
        found += [(f"{2 * self.uv_sets}f", "vertex_uv")] * bool(self.uv_sets)
        found += [("2f", "vertex_layer_uv")] * self.layer_uv
        return found + [(f"{4 * MOST_PRIMVARS}f", "vertex_primvars")] * bool(self.primvars)


def vertex_arrays(meshes: Sequence[Mesh], uvs: Sequence[UvNames], varying: Varying) -> Iterator[NDArray[Any]]:
    """Positions (V, 3), normals (V, 3), indices (T, 3), and what varies beside them. uvs: what fills each one's sets.

    One after another, so that few are held at a time.
    """
    yield _joined([m.points for m in meshes], 3)
    yield _joined([m.normals for m in meshes], 3)
    yield _joined([m.triangles for m in meshes], 3, np.uint32)
    if varying.color_varies:
        yield _joined([_vertex_colors(m) for m in meshes], 4)
    if varying.uv_sets:
        yield _joined([_vertex_uvs(m, names) for m, names in zip(meshes, uvs, strict=True)], 2 * varying.uv_sets)
    if varying.layer_uv:
        yield _joined([_layer_uvs(m) for m in meshes], 2)
    if varying.primvars:
        yield _joined([_vertex_primvars(m, varying.primvars) for m in meshes], 4 * MOST_PRIMVARS)


def _joined(arrays: Sequence[NDArray[Any]], width: int, dtype: type = np.float32) -> NDArray[Any]:
    """One below the other; a scene may have none."""
    return np.concatenate([np.empty((0, width), dtype), *arrays])


def _vertex_colors(mesh: Mesh) -> NDArray[np.float32]:
    """(V, 4) with −1 where the placement's own value counts."""
    colors = np.full((len(mesh.points), 4), -1.0, np.float32)
    if mesh.display_color is not None:
        colors[:, :3] = mesh.display_color
    if mesh.display_opacity is not None:
        colors[:, 3] = mesh.display_opacity
    return colors


def _vertex_uvs(mesh: Mesh, names: UvNames) -> NDArray[np.float32]:
    """(V, 4) or (V, 16), a set in each two; 0, a primvar reader's fallback, for what the mesh lacks."""
    uvs = np.zeros((len(mesh.points), 2 * len(names)), np.float32)
    for number, name in enumerate(names):
        if name in mesh.uvs:
            uvs[:, 2 * number : 2 * number + 2] = mesh.uvs[name]
    return uvs


def _layer_uvs(mesh: Mesh) -> NDArray[np.float32]:
    """(V, 2) the primvar st, else the first set that there is, else 0."""
    sets = [mesh.uvs[name] for name in ("st", *mesh.uvs) if name in mesh.uvs]
    return sets[0] if sets else np.zeros((len(mesh.points), 2), np.float32)


def _vertex_primvars(mesh: Mesh, names: Sequence[str]) -> NDArray[np.float32]:
    """(V, 16) four numbers of each primvar one after another, 0 for what the mesh lacks."""
    values = np.zeros((len(mesh.points), 4 * MOST_PRIMVARS), np.float32)
    for number, name in enumerate(names):
        if name in mesh.primvars:
            width = mesh.primvars[name].shape[1]
            values[:, 4 * number : 4 * number + width] = mesh.primvars[name]
    return values
