"""Surfaces as triangles, kept from frame to frame as long as nothing of them changes."""

from __future__ import annotations

from defshade_cli.usd.control import Control
from defshade_cli.usd.geometry import Gprim, Surface, tessellate
from defshade_cli.usd.refiner import Refiner


class Tessellation:
    """The last triangles of each surface, and the stencils that they were made with.

    The same surface at the same level gives the same object. Points that move under a topology that does not are
    refined by the same stencils.
    """

    def __init__(self) -> None:
        self._gprims: dict[str, tuple[Surface, int, Gprim]] = {}
        self._refiners: dict[str, Refiner] = {}

    def at_level(self, surface: Surface, level: int) -> Gprim:
        """Level 0 is the cage; what is no subdivision surface has no other."""
        known, at, gprim = self._gprims.get(surface.path, (None, 0, None))
        if gprim is None or known is not surface or at != level:
            refiner = self._refiner(surface.path, surface.control, level) if surface.control and level else None
            gprim = tessellate(surface, refiner, gprim if at == level else None)
            self._gprims[surface.path] = surface, level, gprim
        return gprim

    def _refiner(self, path: str, control: Control, level: int) -> Refiner:
        known = self._refiners.get(path)
        if known is None or not known.fits(control, level):
            known = self._refiners[path] = Refiner(control, level)
        return known
