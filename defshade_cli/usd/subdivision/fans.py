"""Fans: runs of faces around a vertex, walked counter-clockwise over the edges that join them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.subdivision.cage import Cage, Indices


@dataclass(frozen=True, eq=False, slots=True)
class Fans:
    """N fans, in ascending order of their vertex, over the H half-edges that leave the vertices.

    fan: (H,) the fan that each half-edge is part of.  rank: (H,) its place in it, counter-clockwise from 0.
    first, last: (N,) half-edges.  size: (N,) faces.  closed: (N,) whether the last face joins the first.
    """

    fan: Indices
    rank: Indices
    first: Indices
    last: Indices
    size: NDArray[np.intp]
    closed: NDArray[np.bool_]


def walk(cage: Cage, joins: NDArray[np.bool_]) -> Fans:
    """The fans whose faces are joined over the half-edges marked in `joins` (H,), seen from their targets."""
    arriving = cage.previous
    following = np.where(joins[arriving], cage.twin[arriving], np.int32(-1))
    led_to = np.zeros(len(following), bool)
    led_to[following[following >= 0]] = True
    first = np.flatnonzero(~led_to)
    rank = np.full(len(following), -1, np.int32)
    head = np.empty_like(rank)
    closed = np.zeros(len(following), bool)
    _follow(following, first, rank, head)
    while (left := np.flatnonzero(rank < 0)).size:  # closed fans, one at each vertex at a time
        first = _lowest_at_vertices(cage, left)
        closed[first] = True
        _follow(following, first, rank, head)
    return _numbered(cage, head, rank, closed)


def _follow(following: Indices, first: NDArray[Any], rank: Indices, head: Indices) -> None:
    """Fills in `rank` and `head`, the first half-edge, along fans; one pass for each face that the longest has."""
    start = current = first
    step = 0
    while len(current):
        rank[current], head[current] = step, start
        current, step = following[current], step + 1
        on_the_way = (current >= 0) & (current != start)
        start, current = start[on_the_way], current[on_the_way]


def _lowest_at_vertices(cage: Cage, half_edges: NDArray[np.intp]) -> NDArray[np.intp]:
    """The first of the ascending `half_edges` at each vertex."""
    lowest = np.full(cage.vertex_count, -1, np.intp)
    lowest[cage.origin[half_edges[::-1]]] = half_edges[::-1]
    return lowest[lowest >= 0]


def _numbered(cage: Cage, head: Indices, rank: Indices, closed: NDArray[np.bool_]) -> Fans:
    first = np.flatnonzero(rank == 0).astype(np.int32)
    first = first[np.argsort(cage.origin[first], kind="stable")]
    number = np.empty(len(head), np.int32)
    number[first] = np.arange(len(first))
    fan = number[head]
    size = np.bincount(fan, minlength=len(first))
    last = np.empty_like(first)
    ends = np.flatnonzero(rank == size[fan] - 1)
    last[fan[ends]] = ends
    return Fans(fan, rank, first, last, size, closed[first])
