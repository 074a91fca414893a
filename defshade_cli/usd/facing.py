"""What depends on where the camera is: lines, and points and curves that at a fixed complexity face it, as in Hydra.

lines    of models in draw modes are a part of the model's size wide, and no thinner than a pixel
auto     points are spheres, round under any transform, and curves are tubes
fixed    points are disks across the view, as wide as it is seen where they stand; curves see usd/curves/strands.py
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.view import View
from defshade_cli.spaces import transform_points
from defshade_cli.usd.gprims.copies import rounded
from defshade_cli.usd.instancing.instancing import Piece, some
from defshade_cli.usd.surfaces.geometry import Surface

PlacedSurface = tuple[Piece, Surface]

_SMALL, _ENLARGED = 16.0, 0.0825
"""Points of fewer pixels are enlarged by this part of what they lack, so that none vanishes: pointDisk.glslfx."""

_WIDEST = 100.0
"""Pixels: HD_GL_POINT_SIZE_MAX of renderPass.glslfx."""


def faced(placed: Iterable[PlacedSurface], view: View, level: int | None) -> Iterator[PlacedSurface]:
    """The surfaces as `view` has them at a level of refinement, None for what they are from all sides."""
    for piece, surface in placed:
        if surface.copies is not None and surface.copies.lines:
            yield _thickened(piece, view), surface
        elif surface.copies is not None:
            spheres = replace(piece, root_from_object=rounded(piece.root_from_object))
            shown = spheres if level is None else _disks(spheres, view)
            if len(shown.ids):
                yield shown, surface
        elif surface.strands is not None and surface.strands.face_at(level):
            yield from _strips(piece, surface, view, level)
        else:
            yield piece, surface


def _thickened(bars: Piece, view: View) -> Piece:
    """Bars along x, as wide as a pixel is where their middles are seen, unless they are wider."""
    placed = bars.root_from_object
    middles = transform_points(view.camera.camera_from_world, placed[:, :3, 3] + 0.5 * placed[:, :3, 0])
    across = np.linalg.norm(placed[:, :3, 1:3], axis=1)
    pixels = across * view.pixels_at(-middles[:, 2])[:, None]
    thick = placed.copy()
    thick[:, :3, 1:3] /= np.where(pixels > 0.0, np.minimum(pixels, 1.0), 1.0)[:, None]
    return replace(bars, root_from_object=thick)


def _disks(spheres: Piece, view: View) -> Piece:
    """Turned to the image, a pixel narrower than they are, as GL draws round points; clipped by their centres."""
    camera = view.camera
    centres = transform_points(camera.camera_from_world, spheres.root_from_object[:, :3, 3])
    planes = camera.clipping_planes
    kept: NDArray[np.bool_] = np.all(centres @ planes[:, :3].T + planes[:, 3] >= 0.0, axis=1)
    disks, density = some(spheres, kept), view.pixels_at(-centres[kept, 2])
    pixels = disks.root_from_object[:, 0, 0] * density
    drawn = np.minimum(pixels + _ENLARGED * np.maximum(_SMALL - pixels, 0.0), _WIDEST) - 1.0
    turned = disks.root_from_object.copy()
    turned[:, :3, :3] = np.where(pixels > 0.0, drawn / density, 0.0)[:, None, None] * camera.world_from_camera[:3, :3]
    return replace(disks, root_from_object=turned)


def _strips(piece: Piece, surface: Surface, view: View, level: int | None) -> Iterator[PlacedSurface]:
    """Each instance of curves by itself: it is seen from where no other is."""
    assert surface.strands is not None
    camera = view.camera
    for number, world_from_object in enumerate(piece.root_from_object):
        strips = surface.strands.facing(camera.camera_from_world @ world_from_object, view, level)
        shown = {
            name: primvar for name, primvar in surface.polygons.shown.items() if primvar.interpolation == "constant"
        }
        faced = replace(surface, polygons=replace(strips.without_constants(), shown=shown), strands=None)
        alone = some(piece, np.arange(len(piece.ids)) == number)
        yield replace(alone, content=faced, root_from_object=camera.world_from_camera[None]), faced
