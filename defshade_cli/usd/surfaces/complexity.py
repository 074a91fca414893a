"""How often subdivision surfaces are refined: as often as asked, or as the camera sees.

Refined once, an edge is half as long, and the polygons are a quarter as far from the surface. `auto` refines each
surface, as it may appear where its nearest instance is closest to the eye, until its edges are no longer than
EDGE_PIXELS or it is nearer than FLAT_PIXELS. What is out of sight counts too, because it casts shadows. Where all that
would make more than TRIANGLE_BUDGET triangles, the surfaces that are farthest from their polygons go first.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.geometry import world_boxes
from defshade_cli.scene.view import View
from defshade_cli.settings import Complexity
from defshade_cli.usd.polygons.flatness import mean_edges, rises
from defshade_cli.usd.surfaces.extent import bounds_of
from defshade_cli.usd.surfaces.geometry import Surface

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
    listed = list(placed)
    nearest = dict.fromkeys([surface for surface, _ in listed], 0.0)
    curved = [(surface, matrices) for surface, matrices in listed if surface.control and len(matrices)]
    for (surface, _), pixels in zip(curved, _pixels_per_unit(curved, view), strict=True):
        nearest[surface] = max(pixels, nearest[surface])
    return _levels_in_budget(nearest)


def _pixels_per_unit(placed: Sequence[tuple[Surface, NDArray[np.float64]]], view: View) -> list[float]:
    """How large an object-space unit of each may appear in the nearest of its instances."""
    if not placed:
        return []
    counts = [len(matrices) for _, matrices in placed]
    world_from_object = np.concatenate([matrices for _, matrices in placed])
    boxes = np.repeat(bounds_of([surface.polygons for surface, _ in placed]), counts, axis=0)
    scale = np.linalg.norm(world_from_object[:, :3, :3], axis=1).max(axis=1)
    pixels = scale * view.pixels_per_unit(world_boxes(boxes, world_from_object))
    greatest: list[float] = np.maximum.reduceat(pixels, np.cumsum([0, *counts])[:-1]).tolist()
    return greatest


def _levels_in_budget(nearest: Mapping[Surface, float]) -> dict[Surface, int]:
    """Refine what is farthest from its surface, again and again. `nearest`: pixels a unit of each."""
    wanted, rise = _wanted_levels(nearest)
    levels = dict.fromkeys(nearest, 0)
    waiting = [(-rise[s] * nearest[s], order, s) for order, (s, level) in enumerate(wanted.items()) if level]
    heapq.heapify(waiting)
    left = TRIANGLE_BUDGET - sum(s.control.triangle_count(0) for s in nearest if s.control)
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


def _wanted_levels(nearest: Mapping[Surface, float]) -> tuple[dict[Surface, int], dict[Surface, float]]:
    """Of the surfaces whose edges are long in the picture, and how far those rise over their cages."""
    curved = [surface for surface in nearest if surface.control]
    edges = mean_edges([surface.polygons for surface in curved])
    halvings = {s: _halvings(edge * nearest[s] / EDGE_PIXELS) for s, edge in zip(curved, edges, strict=True)}
    coarse = [surface for surface, number in halvings.items() if number]
    rise = dict(zip(coarse, rises([surface.polygons for surface in coarse]), strict=True))
    quarterings = {surface: _halvings(rise[surface] * nearest[surface] / FLAT_PIXELS) / 2.0 for surface in coarse}
    return {s: min(math.ceil(min(halvings[s], quarterings[s])), FINEST_LEVEL) for s in coarse}, rise


def _halvings(excess: float) -> float:
    return math.log2(max(excess, 1.0))
