"""Equal polygons made one, so that what follows from them is made once and stays in memory once."""

from __future__ import annotations

from collections.abc import Hashable
from weakref import WeakValueDictionary

from defshade_cli.usd.polygons.polygons import Polygons


class Shapes:
    """The polygons of the surfaces that are in use.

    Most have points of their own: of others alone is asked whether all of them is equal.
    """

    def __init__(self) -> None:
        self._first: WeakValueDictionary[Hashable, Polygons] = WeakValueDictionary()
        self._others: WeakValueDictionary[Hashable, Polygons] = WeakValueDictionary()

    def shared(self, polygons: Polygons) -> Polygons:
        """The polygons that were given first, of those that equal these."""
        first = self._first.setdefault(polygons.place, polygons)
        if first is polygons or first.digest == polygons.digest:
            return first
        return self._others.setdefault(polygons.digest, polygons)
