"""How often subdivision surfaces are refined: as often as asked, or as the camera sees.

Refined once, an edge is half as long. `auto` refines each surface until its edges, as long as they may appear where
its nearest instance is closest to the eye, are no longer than EDGE_PIXELS: 1 to 2 pixels, as the last halving falls.
What is out of sight counts too, because it casts shadows. Where all that would make more than TRIANGLE_BUDGET
triangles, the surfaces with the longest edges are refined first.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.camera import Camera
from defshade_cli.scene.geometry import world_boxes
from defshade_cli.settings import Complexity
from defshade_cli.usd.geometry import Surface

UNIFORM_LEVELS: dict[Complexity, int] = {"low": 0, "medium": 1, "high": 2, "veryhigh": 3}
"""Levels everywhere, as usdrecord's complexities 1.0, 1.1, 1.2 and 1.3."""

EDGE_PIXELS = 2.0
FINEST_LEVEL = 5
TRIANGLE_BUDGET = 4_000_000
"""Of all subdivision surfaces together, each counted once however often it is placed."""


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What a pixel is. camera: conformed to the image.  height: of the image, pixels."""

    camera: Camera
    height: int

    def pixels_per_unit(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N,) how large a unit may appear in world-space boxes (N, 2, 3): at their points nearest to the eye."""
        _, _, bottom, top = self.camera.window
        scale = self.height / (top - bottom)
        if self.camera.projection == "orthographic":
            return np.full(len(boxes), scale)
        eye = self.camera.position
        apart = np.maximum(np.maximum(boxes[:, 0] - eye, eye - boxes[:, 1]), 0.0)
        return scale / np.maximum(np.linalg.norm(apart, axis=1), self.camera.clipping_range[0])


def choose_levels(
    placed: Iterable[tuple[Surface, NDArray[np.float64]]], complexity: Complexity, view: View
) -> dict[Surface, int]:
    """The level of each surface that `placed` gives with its world_from_object (N, 4, 4); 0 for polygons."""
    if complexity != "auto":
        return {s: UNIFORM_LEVELS[complexity] if s.control else 0 for s, _ in placed}
    edges: dict[Surface, float] = {}
    for surface, world_from_object in placed:
        pixels = _edge_pixels(surface, world_from_object, view) if surface.control else 0.0
        edges[surface] = max(pixels, edges.get(surface, 0.0))
    return _levels_in_budget(edges)


def _edge_pixels(surface: Surface, world_from_object: NDArray[np.float64], view: View) -> float:
    """How long the mean edge of the cage may appear in the nearest of its instances."""
    scale = np.linalg.norm(world_from_object[:, :3, :3], axis=1).max(axis=1)
    density = view.pixels_per_unit(world_boxes(surface.polygons.bounds, world_from_object))
    return surface.polygons.mean_edge * float(np.max(scale * density, initial=0.0))


def _levels_in_budget(edges: Mapping[Surface, float]) -> dict[Surface, int]:
    """Halve the longest edges, again and again."""
    levels = dict.fromkeys(edges, 0)
    longest = [(-pixels, order, s) for order, (s, pixels) in enumerate(edges.items()) if pixels > EDGE_PIXELS]
    heapq.heapify(longest)
    left = TRIANGLE_BUDGET - sum(s.control.triangle_count(0) for s in edges if s.control)
    while longest:
        negative, order, surface = heapq.heappop(longest)
        assert surface.control is not None
        level = levels[surface]
        cost = surface.control.triangle_count(level + 1) - surface.control.triangle_count(level)
        if cost <= left:
            left -= cost
            levels[surface] = level + 1
            if -negative / 2 > EDGE_PIXELS and level + 1 < FINEST_LEVEL:
                heapq.heappush(longest, (negative / 2, order, surface))
    return levels
