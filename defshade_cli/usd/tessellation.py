"""Surfaces as triangles, kept from frame to frame as long as nothing of them changes."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple
from weakref import WeakKeyDictionary

from defshade_cli.usd.control import Control
from defshade_cli.usd.geometry import FaceGroup, Gprim, Surface, tessellate
from defshade_cli.usd.polygons import Polygons
from defshade_cli.usd.refiner import Refiner


class Tessellation:
    """The last triangles of each surface, and the stencils that they were made with.

    The same surface at the same level gives the same object, and surfaces that share their polygons share the mesh.
    Points that move under a topology that does not are refined by the same stencils.
    """

    def __init__(self) -> None:
        self._gprims: dict[str, tuple[Surface, int, Gprim]] = {}
        self._of_shape: WeakKeyDictionary[Polygons, list[_Cut]] = WeakKeyDictionary()
        self._refiners: dict[str, Refiner] = {}

    def at_level(self, surface: Surface, level: int) -> Gprim:
        """Level 0 is the cage; what is no subdivision surface has no other."""
        known, at, gprim = self._gprims.get(surface.path, (None, 0, None))
        if gprim is None or known is not surface or at != level:
            gprim = self._shared(surface, level) if surface.faces.group is None else self._cut(surface, level)
            self._gprims[surface.path] = surface, level, gprim
        return gprim

    def _shared(self, surface: Surface, level: int) -> Gprim:
        """The triangles of all surfaces with this shape."""
        cuts = self._of_shape.setdefault(surface.polygons, [])
        for cut in cuts:
            if cut.serves(surface, level):
                return _renamed(cut.gprim, surface.path)
        gprim = self._cut(surface, level)
        cuts.append(_Cut(surface.control, surface.double_sided, level, gprim))
        return gprim

    def _cut(self, surface: Surface, level: int) -> Gprim:
        refiner = self._refiner(surface.path, surface.control, level) if surface.control and level else None
        return tessellate(surface, refiner)

    def _refiner(self, path: str, control: Control, level: int) -> Refiner:
        known = self._refiners.get(path)
        if known is None or not known.fits(control, level):
            known = self._refiners[path] = Refiner(control, level)
        return known


class _Cut(NamedTuple):
    """Triangles, and what they were made of beside polygons."""

    control: Control | None
    double_sided: bool
    level: int
    gprim: Gprim

    def serves(self, surface: Surface, level: int) -> bool:
        if level != self.level or surface.double_sided != self.double_sided:
            return False
        mine, other = self.control, surface.control
        return mine is other or (mine is not None and other is not None and mine.equals(other))


def _renamed(gprim: Gprim, path: str) -> Gprim:
    """The same triangles, all of one group, for another prim."""
    groups = tuple(FaceGroup(path, group.first, group.count) for group in gprim.groups)
    return Gprim(gprim.mesh, groups, tuple(replace(issue, path=path) for issue in gprim.issues))
