"""Pieces of the same looks as instances of one mesh."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.arrays import frozen
from defshade_cli.scene.geometry import Drawable, Mesh, Subset
from defshade_cli.scene.light import Light
from defshade_cli.scene.material import Material
from defshade_cli.usd.facing import PlacedSurface
from defshade_cli.usd.instancing.instancing import Piece
from defshade_cli.usd.lights.mesh_light import Glow, shown_material
from defshade_cli.usd.palette import Palette
from defshade_cli.usd.surfaces.geometry import FaceGroup, Gprim, Surface

Glowing = tuple[Glow, tuple[Light, ...]]

Alike = tuple[int, tuple[int, ...], bool | Piece]
"""What pieces have in common that are instances of one Drawable: their mesh, materials, and how they are named."""


def drawables_of(
    drawn: Iterable[PlacedSurface],
    gprims: Mapping[Surface, Gprim],
    meshes: dict[Mesh, int],
    palette: Palette,
    glowing: Mapping[Piece, Glowing],
) -> Iterator[Drawable]:
    """What is drawn; `meshes` takes the meshes, each with its number."""
    alike: dict[Alike, list[Piece]] = defaultdict(list)
    looks: dict[Alike, tuple[Material, tuple[FaceGroup, ...]]] = {}
    for piece, surface in drawn:
        gprim = gprims[surface]
        if not gprim.groups:
            continue
        for part, materials in palette.worn(piece, gprim):
            if piece in glowing:
                glow, lights = glowing[piece]
                materials = [shown_material(material, glow, lights[0]) for material in materials]
            numbers = tuple([palette.number_of(material) for material in materials])
            named = len(part.paths) == len(part.ids)
            key = meshes.setdefault(gprim.mesh, len(meshes)), numbers, named or part
            alike[key].append(part)
            looks[key] = materials[0], gprim.groups
    standing = _standing(list(alike.values()), [material for material, _ in looks.values()])
    for (mesh, numbers, _), pieces, (_, groups), placed in zip(
        alike, alike.values(), looks.values(), standing, strict=True
    ):
        subsets = tuple([Subset(n, group.first, group.count) for n, group in zip(numbers, groups, strict=True)])
        paths = tuple([path for piece in pieces for path in piece.paths])
        yield Drawable(mesh, placed[0], subsets, paths, *placed[1:])


def _standing(groups: Sequence[Sequence[Piece]], unauthored: Sequence[Material]) -> Iterator[Sequence[NDArray[Any]]]:
    """Of each group the matrices, ids, colours and opacities of its pieces, as runs of arrays that hold all.

    unauthored: has the colour of those that have none.
    """
    if not groups:
        return
    pieces = [piece for group in groups for piece in group]
    ends = np.cumsum([sum([len(piece.ids) for piece in group]) for group in groups], dtype=np.intp)
    sizes = np.diff(ends, prepend=0)
    color, opacity = _joined([p.display_color for p in pieces]), _joined([p.display_opacity for p in pieces])
    arrays = (
        frozen(_joined([piece.root_from_object for piece in pieces]), np.float64, -1, 4, 4),
        frozen(_joined([piece.ids for piece in pieces]), np.int32, -1),
        frozen(_where_nan(color, [m.diffuse_color for m in unauthored], sizes), np.float32, -1, 3),
        frozen(_where_nan(opacity, [m.opacity for m in unauthored], sizes), np.float32, -1),
    )
    for first, end in pairwise([0, *ends.tolist()]):
        yield [array[first:end] for array in arrays]


def _where_nan(values: NDArray[np.float32], others: Sequence[Any], sizes: NDArray[np.intp]) -> NDArray[np.float32]:
    """`values`, and of each group of so many one of `others` where they are NaN."""
    return np.where(np.isnan(values), np.repeat(np.array(others, np.float32), sizes, axis=0), values)


def _joined(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)
