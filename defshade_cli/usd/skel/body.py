"""What of a surface a skeleton bends: the points of a mesh, the control points of curves, the places of points."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defshade_cli.usd.curves.sweep import swept
from defshade_cli.usd.polygons.polygons import Polygons, Primvar
from defshade_cli.usd.surfaces.geometry import Surface


class Body(NamedTuple):
    """Polygons whose points and normals move; a cloud without faces where the surface is none of its own.

    authored: how many points the prim has.  rows: (P,) which of them these are; None for all in order.
    """

    polygons: Polygons
    authored: int
    rows: NDArray[np.integer] | None = None


def body_of(surface: Surface) -> Body:
    """What of the surface bends: its polygons, else points of strands or of copies."""
    if surface.strands is not None:
        strands = surface.strands
        normals = strands.normals if strands.normals and strands.normals.interpolation == "vertex" else None
        return Body(_cloud(strands.points, normals), len(strands.points))
    if surface.copies is not None:
        return Body(_cloud(surface.copies.positions), surface.copies.authored, surface.copies.ids)
    return Body(surface.polygons, len(surface.polygons.points))


def with_body(surface: Surface, polygons: Polygons) -> Surface:
    """The surface with the points and normals of its body moved. Raises ValueError for any that are not finite."""
    if surface.strands is None and surface.copies is None:
        if not np.isfinite(polygons.bounds).all():
            raise ValueError("its deformed points are not finite")
        return replace(surface, polygons=polygons)
    if not np.isfinite(polygons.points).all():
        raise ValueError("its deformed points are not finite")
    if surface.copies is not None:
        return replace(surface, copies=surface.copies.moved(polygons.points))
    assert surface.strands is not None
    strands = replace(surface.strands, points=polygons.points, normals=polygons.normals or surface.strands.normals)
    return replace(surface, strands=strands, polygons=replace(swept(strands), shown=surface.polygons.shown))


def _cloud(points: NDArray[np.float32], normals: Primvar | None = None) -> Polygons:
    none = np.empty(0, np.int32)
    return Polygons(points=points, counts=none, indices=none, faces=none, normals=normals)
