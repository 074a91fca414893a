"""Small meshes as polygons, checked all at once.

Of what is sound in everything nothing needs to be said: it becomes what mesh.py makes of it, which has the others.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from defshade_cli.usd.polygons.end_to_end import blocks, each_finite, each_greatest, lay_bare
from defshade_cli.usd.polygons.lying import are_as_many, are_sound, carried
from defshade_cli.usd.polygons.normals import unit_normals
from defshade_cli.usd.polygons.polygons import Interpolation, Polygons, Primvar
from defshade_cli.usd.polygons.primvars import NOTHING_CARRIED, count_elements
from defshade_cli.usd.polygons.told import Told


def check_all(meshes: Sequence[Told]) -> list[Polygons | None]:
    """The polygons of each mesh that is sound, None of any other."""
    sound = {number for number, drawn in enumerate(_are_drawn(meshes)) if drawn}
    sound -= {number for number in sound if not _fits(meshes[number])}
    lying = [(number, each) for number in sound for each in meshes[number].lying]
    sound -= {
        number for (number, _), fine in zip(lying, are_sound([each for _, each in lying]), strict=True) if not fine
    }
    with_normals = [number for number in sound if meshes[number].normals]
    normals = _unit_normals({number: meshes[number] for number in with_normals})
    sound -= {*with_normals} - normals.keys()
    return [_polygons(mesh, normals.get(n)) if n in sound else None for n, mesh in enumerate(meshes)]


def _are_drawn(meshes: Sequence[Told]) -> list[bool]:
    """Are all corners at points that exist, all points finite, and all holes faces?"""
    if not meshes:
        return []
    within = each_greatest([mesh.indices for mesh in meshes]) < [len(mesh.points) for mesh in meshes]
    sound = within & each_finite([mesh.points for mesh in meshes])
    holed = [number for number, mesh in enumerate(meshes) if len(mesh.holes)]
    if holed:
        sound[holed] &= each_greatest([meshes[n].holes for n in holed]) < [len(meshes[n].counts) for n in holed]
    return sound.tolist()


def _fits(mesh: Told) -> bool:
    """Have its primvars and normals as many values as they need?"""
    if not mesh.lying:
        return True
    due = count_elements(len(mesh.counts), len(mesh.points), len(mesh.indices))
    return are_as_many(mesh.lying, due)


def _unit_normals(meshes: Mapping[int, Told]) -> dict[int, Primvar]:
    """Of the meshes whose normals need no other mending."""
    alike: dict[tuple[bool, Interpolation], list[int]] = defaultdict(list)
    normals = {number: mesh.normals for number, mesh in meshes.items() if mesh.normals}
    for number, each in normals.items():
        alike[meshes[number].left_handed, each.interpolation].append(number)
    found: dict[int, Primvar] = {}
    for (_, interpolation), numbers in alike.items():
        for block in blocks(numbers, [len(meshes[number].indices) for number in numbers]):
            row = lay_bare([meshes[number] for number in block])
            values = np.concatenate([normals[number].primvar.values for number in block])
            units, clear = unit_normals(row, Primvar(values, interpolation))
            runs = pairwise(row.starts(interpolation).tolist())
            for number, run, is_clear in zip(block, runs, clear.tolist(), strict=True):
                if is_clear:
                    found[number] = Primvar(units[slice(*run)], interpolation)
    return found


def _polygons(mesh: Told, normals: Primvar | None) -> Polygons:
    return Polygons(
        mesh.points,
        mesh.counts,
        mesh.indices,
        mesh.faces,
        mesh.holes,
        mesh.scheme,
        mesh.left_handed,
        normals,
        *(carried(mesh.carried) if mesh.carried else NOTHING_CARRIED),
    )
