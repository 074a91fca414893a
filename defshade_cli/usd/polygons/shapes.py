"""Equal polygons made one, so that what follows from them is made once and stays in memory once."""

from __future__ import annotations

from collections.abc import Hashable
from weakref import WeakValueDictionary

from defshade_cli.usd.polygons.polygons import Polygons


class Shapes:
    """The polygons of the surfaces that are in use."""

    def __init__(self) -> None:
        self._known: WeakValueDictionary[Hashable, Polygons] = WeakValueDictionary()

    def shared(self, polygons: Polygons) -> Polygons:
        """The polygons that were given first, of those that equal these."""
        return self._known.setdefault(polygons.digest(), polygons)
