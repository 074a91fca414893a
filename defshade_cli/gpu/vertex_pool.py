"""The vertices of all meshes in one buffer for each kind of array; a mesh that moves takes its old place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from defshade_cli.gpu.buffers import replaced
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.vertices import UvNames, Varying, vertex_arrays
from defshade_cli.scene.geometry import Mesh

_INDICES = 2
"""Which of the vertex arrays has a row a triangle; the others have one a vertex."""

Attributes = tuple[Any, ...]
"""A buffer, its format and the names of what is in it, as moderngl takes them."""


class VertexPool:
    """Of one scene after another."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._meshes: tuple[Mesh, ...] = ()
        self._made_for: tuple[Any, ...] = ()
        self._buffers: list[moderngl.Buffer] = []

    def update(
        self, meshes: tuple[Mesh, ...], uvs: tuple[UvNames, ...], varying: Varying
    ) -> tuple[list[Attributes], moderngl.Buffer]:
        """Make meshes resident: attributes of their vertices, and the indices. uvs: what fills each one's sets."""
        made_for = varying, uvs if varying.uv_sets else ()
        if made_for == self._made_for and _are_alike(self._meshes, meshes):
            self._overwrite(meshes, uvs, varying)
        else:
            self._buffers = replaced(self._gpu, self._buffers, vertex_arrays(meshes, uvs, varying))
        self._meshes, self._made_for = meshes, made_for
        positions, normals, indices, *others = self._buffers
        named = zip(others, varying.attributes, strict=True)
        attributes: list[Attributes] = [(positions, "3f", "position_object"), (normals, "3f", "normal_object")]
        return attributes + [(buffer, *attribute) for buffer, attribute in named], indices

    def _overwrite(self, meshes: tuple[Mesh, ...], uvs: tuple[UvNames, ...], varying: Varying) -> None:
        """Upload the meshes that are not the same as before, each to its place."""
        firsts = first_rows(meshes)
        for number, (old, new) in enumerate(zip(self._meshes, meshes, strict=True)):
            if old is not new:
                arrays = vertex_arrays([new], uvs[number : number + 1], varying)
                for kind, (buffer, array) in enumerate(zip(self._buffers, arrays, strict=True)):
                    row = firsts[number, 1 if kind == _INDICES else 0]
                    buffer.write(np.ascontiguousarray(array), offset=int(row) * array[:1].nbytes)


def first_rows(meshes: Sequence[Mesh]) -> NDArray[np.int64]:
    """(M + 1, 2) vertices and triangles before each mesh, and all of them."""
    sizes = [(len(mesh.points), len(mesh.triangles)) for mesh in meshes]
    return np.cumsum([(0, 0), *sizes], axis=0, dtype=np.int64)


def _are_alike(old: tuple[Mesh, ...], new: tuple[Mesh, ...]) -> bool:
    """Do the meshes take the same places in the pool?"""
    return bool(old) and np.array_equal(first_rows(old), first_rows(new))
