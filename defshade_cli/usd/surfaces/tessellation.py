"""Surfaces as triangles, kept from frame to frame as long as nothing of them changes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple
from weakref import WeakKeyDictionary, ref

from defshade_cli.usd.polygons.control import Control
from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.polygons.small_meshes import Shaped, shape_all
from defshade_cli.usd.surfaces.geometry import FaceGroup, Gprim, Surface, tessellate

if TYPE_CHECKING:
    from defshade_cli.usd.polygons.refiner import Refiner


class Tessellation:
    """The last triangles of each surface, and the stencils that they were made with.

    The same surface at the same level gives the same object, and surfaces that share their polygons share the mesh.
    Points that move under a topology that does not are refined by the same stencils.
    """

    def __init__(self) -> None:
        self._gprims: dict[str, tuple[Surface, int, Gprim]] = {}
        self._of_shape: WeakKeyDictionary[Polygons, list[_Alike]] = WeakKeyDictionary()
        self._refiners: dict[str, Refiner] = {}

    def at_levels(self, levels: Mapping[Surface, int]) -> dict[Surface, Gprim]:
        """Of surfaces that have none yet, small ones are refined and shaped together."""
        unknown = {
            surface: level
            for surface, level in levels.items()
            if surface.path not in self._gprims and surface.polygons not in self._of_shape
        }
        drawn = {surface: surface.polygons for surface, level in unknown.items() if level == 0} | _refined(unknown)
        shaped = shape_all(drawn.values())
        known = {surface: shaped[polygons] for surface, polygons in drawn.items() if polygons in shaped}
        return {surface: self.at_level(surface, level, known.get(surface)) for surface, level in levels.items()}

    def at_level(self, surface: Surface, level: int, shaped: Shaped | None = None) -> Gprim:
        """Level 0 is the cage; what is no subdivision surface has no other. shaped: see tessellate, of this level."""
        known, at, gprim = self._gprims.get(surface.path, (None, 0, None))
        if gprim is None or known is not surface or at != level:
            last = gprim if at == level else None
            cut = self._shared if surface.faces.group is None else self._cut
            gprim = cut(surface, level, last, shaped)
            self._gprims[surface.path] = surface, level, gprim
        return gprim

    def _shared(self, surface: Surface, level: int, last: Gprim | None, shaped: Shaped | None) -> Gprim:
        """The triangles of all surfaces with this shape that are in use."""
        alike = [one for one in self._of_shape.get(surface.polygons, ()) if one.gprim() is not None]
        for one in alike:
            gprim = one.gprim()
            if gprim is not None and one.serves(surface, level):
                return _renamed(gprim, surface)
        gprim = self._cut(surface, level, last, shaped)
        alike.append(_Alike(surface.control, surface.double_sided, level, ref(gprim)))
        self._of_shape[surface.polygons] = alike
        return gprim

    def _cut(self, surface: Surface, level: int, last: Gprim | None, shaped: Shaped | None) -> Gprim:
        if shaped or not surface.control or not level:
            return tessellate(surface, None, last, shaped, level=level)
        return tessellate(surface, self._refiner(surface.path, surface.control, level), last)

    def _refiner(self, path: str, control: Control, level: int) -> Refiner:
        known = self._refiners.get(path)
        if known is None or not known.fits(control, level):
            from defshade_cli.usd.polygons.refiner import Refiner

            known = self._refiners[path] = Refiner(control, level)
        return known


class _Alike(NamedTuple):
    """Triangles, and what they were made of beside polygons."""

    control: Control | None
    double_sided: bool
    level: int
    gprim: ref[Gprim]

    def serves(self, surface: Surface, level: int) -> bool:
        if level != self.level or surface.double_sided != self.double_sided:
            return False
        mine, other = self.control, surface.control
        return mine is other or (mine is not None and other is not None and mine.equals(other))


def _refined(levels: Mapping[Surface, int]) -> dict[Surface, Polygons]:
    """Of those that have a level and are small. Of several that share their polygons only the first one is made."""
    first: dict[Polygons, tuple[Surface, Control, int]] = {}
    for surface, level in levels.items():
        if level and surface.control:
            first.setdefault(surface.polygons, (surface, surface.control, level))
    if not first:
        return {}
    from defshade_cli.usd.polygons.small_cages import Cage, refine_all

    cages: dict[int, dict[Cage, Surface]] = defaultdict(dict)
    for surface, control, level in first.values():
        cages[level][Cage(surface.polygons, control)] = surface
    return {alike[cage]: made for level, alike in cages.items() for cage, made in refine_all(alike, level).items()}


def _renamed(gprim: Gprim, surface: Surface) -> Gprim:
    """The same triangles, all of one group, for another prim."""
    groups = tuple(FaceGroup(surface.faces.paths[0], group.first, group.count) for group in gprim.groups)
    issues = tuple(replace(issue, path=surface.path) for issue in gprim.issues)
    return Gprim(gprim.mesh, groups, issues, gprim.cut._replace(faces=surface.faces, groups=groups))
