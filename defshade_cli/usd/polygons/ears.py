"""Ear clipping of many polygons at once.

A corner is an ear when its triangle holds no other corner; a simple polygon always has two (Meisters 1975),
and only reflex corners can lie inside (Eberly, "Triangulation by Ear Clipping"). Each round clips every
polygon of ears that are no neighbours: common shapes take some log n rounds, a spiral, which has but two, n/2.
What comes out for a polygon does not depend on the others.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]

_FIRST_TESTS = 8
_TESTS_AT_ONCE = 1 << 20
_FORCED_SHARE = 16


def clip_ears(uv: NDArray[np.float64]) -> Indices:
    """Triangles (B, n − 2, 3), as corners 0…n−1, of B counter-clockwise polygons (B, n, 2).

    Collinear and coincident corners are allowed, so a hole may be reached by a bridge. Where a polygon
    crosses itself and has no ear left, its flattest corners go first: always n − 2 triangles, the least harm.
    """
    rings = _Rings(uv)
    triangles = []
    changed = np.arange(len(rings.uv))
    while len(changed):
        rings.classify(changed)
        tips = rings.independent_ears()
        triangles.append(np.stack([rings.previous[tips], tips, rings.next[tips]], axis=1))
        changed = rings.clip(tips)
    count, size = uv.shape[:2]
    clipped = np.concatenate(triangles)
    order = np.argsort(clipped[:, 1] // size, kind="stable")
    return clipped[order].reshape(count, size - 2, 3) % size


class _Rings:
    """Polygons as linked rings of corners, which lie flat in one array.

    turn: twice the area of the triangle at each corner; reflex corners have turn ≤ 0, clipped ones +inf.
    """

    def __init__(self, uv: NDArray[np.float64]) -> None:
        count, size = uv.shape[:2]
        corners = np.arange(count * size).reshape(count, size)
        self.uv = uv.reshape(-1, 2)
        self.polygon = np.repeat(np.arange(count), size)
        self.next = np.roll(corners, -1, axis=1).ravel()
        self.previous = np.roll(corners, 1, axis=1).ravel()
        self.left = np.full(count, size)
        self.turn = self._turns(corners.ravel())
        self.ear = np.zeros(count * size, bool)
        self._priority = np.tile(np.arange(size) * 2654435761 % 2**32, count)  # Knuth's hash: neighbours in no order
        self._key = (self.polygon.reshape(count, size) + 0.5 * _unit(uv[..., 0])).ravel()
        reflex = np.flatnonzero(self.turn <= 0.0)
        self._reflex = reflex[np.argsort(self._key[reflex])]

    def classify(self, corners: Indices) -> None:
        """Find anew which of these corners are reflex, and which are ears."""
        self.turn[corners] = self._turns(corners)
        self.ear[corners] = False
        convex = corners[self.turn[corners] > 0.0]
        self.ear[convex] = ~self._blocked(convex)

    def independent_ears(self) -> Indices:
        """Ears of which no two are neighbours, at least one in every ring that has a triangle left."""
        candidates = self.ear
        stuck = (self.left > 2) & (np.bincount(self.polygon[candidates], minlength=len(self.left)) == 0)
        if stuck.any():
            candidates = candidates.copy()
            candidates[self._flattest(stuck)] = True
        ears = np.flatnonzero(candidates)
        rank = np.where(candidates, self._priority, -1)
        first = (rank[ears] > rank[self.previous[ears]]) & (rank[ears] > rank[self.next[ears]])
        return ears[first]

    def clip(self, tips: Indices) -> Indices:
        """Take `tips` out of their rings; the corners whose triangles changed by that."""
        before, after = self.previous[tips], self.next[tips]
        self.next[before] = after
        self.previous[after] = before
        self.turn[tips] = np.inf
        self.ear[tips] = False
        self.left -= np.bincount(self.polygon[tips], minlength=len(self.left))
        return np.unique(np.concatenate([before, after]))

    def _turns(self, corners: Indices) -> NDArray[np.float64]:
        return _turn(self.uv[self.previous[corners]], self.uv[corners], self.uv[self.next[corners]])

    def _flattest(self, stuck: Mask) -> Indices:
        """The sixteenth of each stuck ring's corners, one at the least, with the smallest triangles."""
        corners = np.flatnonzero(stuck[self.polygon] & (self.turn < np.inf))
        corners = corners[np.lexsort((np.abs(self.turn[corners]), self.polygon[corners]))]
        polygon = self.polygon[corners]
        place = np.arange(len(corners)) - np.searchsorted(polygon, polygon)
        return corners[place * _FORCED_SHARE < self.left[polygon]]

    def _blocked(self, tips: Indices) -> Mask:
        """Which triangles hold a reflex corner? Those in the triangle's span of u are tried, more each time."""
        key = self._key[np.stack([self.previous[tips], tips, self.next[tips]])]
        first = np.searchsorted(self._key[self._reflex], key.min(axis=0), "left")
        end = np.searchsorted(self._key[self._reflex], key.max(axis=0), "right")
        blocked = np.zeros(len(tips), bool)
        pending, tests = np.flatnonzero(first < end), _FIRST_TESTS
        while len(pending):
            for part in np.array_split(pending, -(-len(pending) * tests // _TESTS_AT_ONCE)):
                tried = np.minimum(first[part, None] + np.arange(tests), end[part, None] - 1)
                blocked[part] = self._holds(tips[part], self._reflex[tried]).any(axis=1)
            first[pending] += tests
            tests *= 2
            pending = pending[~blocked[pending] & (first[pending] < end[pending])]
        return blocked

    def _holds(self, tips: Indices, corners: Indices) -> Mask:
        """(K, N) does the closed triangle at each of K tips hold the reflex corners (K, N)?

        A corner that coincides with one of the triangle's own, as at a bridge, is none of its inside.
        """
        triangle = self.uv[np.stack([self.previous[tips], tips, self.next[tips]]), None]
        point = self.uv[corners]
        held = self.turn[corners] <= 0.0
        for start, end in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
            held &= (_turn(start, end, point) >= 0.0) & (point != start).any(axis=-1)
        return held


def _turn(a: NDArray[Any], b: NDArray[Any], c: NDArray[Any]) -> NDArray[np.float64]:
    """Twice the signed area of triangles (..., 2), positive counter-clockwise."""
    ab, ac = b - a, c - a
    return ab[..., 0] * ac[..., 1] - ab[..., 1] * ac[..., 0]


def _unit(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows mapped to [0, 1]."""
    low, high = values.min(axis=1, keepdims=True), values.max(axis=1, keepdims=True)
    return (values - low) / np.where(high > low, high - low, 1.0)
