"""How often subdivision surfaces are refined: as often as asked, or as the camera sees.

Refined once, an edge is half as long, and the polygons are a quarter as far from the surface. `auto` refines each
surface, as it may appear where its nearest instance is closest to the eye, until its edges are no longer than
EDGE_PIXELS or it is nearer than FLAT_PIXELS. What is out of sight counts too, because it casts shadows. Where all that
would make more than TRIANGLE_BUDGET triangles, the surfaces that are farthest from their polygons go first.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.geometry import world_boxes
from defshade_cli.scene.view import View
from defshade_cli.settings import Complexity
from defshade_cli.usd.geometry import Surface

UNIFORM_LEVELS: dict[Complexity, int] = {"low": 0, "medium": 1, "high": 2, "veryhigh": 3}
"""Levels everywhere, as usdrecord's complexities 1.0, 1.1, 1.2 and 1.3."""

EDGE_PIXELS = 2.0
FLAT_PIXELS = 0.1
FINEST_LEVEL = 5
TRIANGLE_BUDGET = 2_000_000
"""Of all subdivision surfaces together, each counted once however often it is placed."""


def choose_levels(
    placed: Iterable[tuple[Surface, NDArray[np.float64]]], complexity: Complexity, view: View
) -> dict[Surface, int]:
    """The level of each surface that `placed` gives with its world_from_object (N, 4, 4); 0 for polygons."""
    if complexity != "auto":
        return {s: UNIFORM_LEVELS[complexity] if s.control else 0 for s, _ in placed}
    nearest: dict[Surface, float] = {}
    for surface, world_from_object in placed:
        nearest[surface] = max(_pixels_per_unit(surface, world_from_object, view), nearest.get(surface, 0.0))
    return _levels_in_budget(nearest)


def _pixels_per_unit(surface: Surface, world_from_object: NDArray[np.float64], view: View) -> float:
    """How large an object-space unit may appear in the nearest of its instances; 0 for polygons."""
    if surface.control is None:
        return 0.0
    scale = np.linalg.norm(world_from_object[:, :3, :3], axis=1).max(axis=1)
    density = view.pixels_per_unit(world_boxes(surface.polygons.bounds, world_from_object))
    return float(np.max(scale * density, initial=0.0))


def _levels_in_budget(nearest: Mapping[Surface, float]) -> dict[Surface, int]:
    """Refine what is farthest from its surface, again and again. `nearest`: pixels a unit of each."""
    wanted = {surface: _wanted_level(surface, pixels) for surface, pixels in nearest.items()}
    levels = dict.fromkeys(wanted, 0)
    waiting = [(-s.rise * nearest[s], order, s) for order, (s, level) in enumerate(wanted.items()) if level]
    heapq.heapify(waiting)
    left = TRIANGLE_BUDGET - sum(s.control.triangle_count(0) for s in wanted if s.control)
    while waiting:
        distance, order, surface = heapq.heappop(waiting)
        assert surface.control is not None
        level = levels[surface]
        cost = surface.control.triangle_count(level + 1) - surface.control.triangle_count(level)
        if cost <= left:
            left -= cost
            levels[surface] = level + 1
            if level + 1 < wanted[surface]:
                heapq.heappush(waiting, (distance / 4.0, order, surface))
    return levels


def _wanted_level(surface: Surface, pixels_per_unit: float) -> int:
    if surface.control is None:
        return 0
    halvings = _halvings(surface.mean_edge * pixels_per_unit / EDGE_PIXELS)
    if not halvings:
        return 0
    quarterings = _halvings(surface.rise * pixels_per_unit / FLAT_PIXELS) / 2.0
    return min(math.ceil(min(halvings, quarterings)), FINEST_LEVEL)


def _halvings(excess: float) -> float:
    return math.log2(max(excess, 1.0))
