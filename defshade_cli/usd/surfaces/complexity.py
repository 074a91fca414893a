"""How often subdivision surfaces are refined: as often as asked, or as the camera sees.

Refined once, an edge is half as long, and the polygons are a quarter as far from the surface. `auto` refines each
surface, as it may appear where its nearest instance is closest to the eye, until its edges are no longer than
EDGE_PIXELS or it is nearer than FLAT_PIXELS. What is out of sight counts too, because it casts shadows. Where all that
would make more than TRIANGLE_BUDGET triangles, the surfaces that are farthest from their polygons go first.

Solids are round to begin with. Where there are so many of them that it counts, those that are small in the picture get
half as many segments again and again, a level below 0 each time, as long as they are off by less than FLAT_PIXELS.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Container, Iterable, Mapping, Sequence

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

MANY_TRIANGLES = 500_000
"""Of all solids together, each counted as often as it is placed: up to so many, all are as round as can be."""

FEWEST_SEGMENTS = 8
"""Around a solid."""

Placed = tuple[Surface, NDArray[np.float64]]
"""A surface and its world_from_object (N, 4, 4)."""


def choose_levels(
    placed: Iterable[Placed], complexity: Complexity, view: View, shining: Container[str] = ()
) -> dict[Surface, int]:
    """The level of each surface, 0 for polygons. shining: paths of surfaces whose areas count as light."""
    if complexity != "auto":
        return {s: UNIFORM_LEVELS[complexity] if s.control else 0 for s, _ in placed}
    listed = list(placed)
    nearest = dict.fromkeys([surface for surface, _ in listed], 0.0)
    nearest |= _nearest([(surface, matrices) for surface, matrices in listed if surface.control], view)
    solids = [(s, m) for s, m in listed if s.solid and s.faces.group is None and s.path not in shining]
    return _levels_in_budget(nearest) | _levels_of_solids(solids, view)


def _levels_of_solids(placed: Sequence[Placed], view: View) -> dict[Surface, int]:
    """None where they are few. A circle of radius r lies r (1 - cos(pi / n)) outside of its polygon of n corners."""
    if sum(2 * len(surface.polygons.counts) * len(matrices) for surface, matrices in placed) <= MANY_TRIANGLES:
        return {}
    levels = {}
    for surface, pixels in _nearest(placed, view).items():
        assert surface.solid is not None
        radius = 0.5 * pixels * float(np.median(np.diff(surface.polygons.bounds, axis=0)))
        enough = math.pi / math.acos(1.0 - min(FLAT_PIXELS / max(radius, FLAT_PIXELS), 1.0))
        levels[surface] = -int(math.log2(max(surface.solid.segments / max(enough, FEWEST_SEGMENTS), 1.0)))
    return levels


def _nearest(placed: Sequence[Placed], view: View) -> dict[Surface, float]:
    """How large an object-space unit of each may appear in the nearest of its instances; not of what has none."""
    shown = [(surface, matrices) for surface, matrices in placed if len(matrices)]
    nearest: dict[Surface, float] = {}
    for (surface, _), pixels in zip(shown, _pixels_per_unit(shown, view), strict=True):
        nearest[surface] = max(pixels, nearest.get(surface, 0.0))
    return nearest


def _pixels_per_unit(placed: Sequence[Placed], view: View) -> list[float]:
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
