"""Whether geometry lies within a ball, by boxes around its triangles: it may say yes too often, never no."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.scene.geometry import Mesh, world_boxes
from defshade_cli.scene.scene import Scene

_MOST_TRIANGLES = 2**20
"""More, near the ball and not yet told apart, count as within it."""


def reaches_into_ball(scene: Scene, centre: NDArray[np.float64], radius: float) -> bool:
    """Around `centre` (3,), world space."""
    near = _near(scene.drawable_bounds, centre, radius)
    for drawable in (scene.drawables[i] for i in np.flatnonzero(near)):
        mesh = scene.meshes[drawable.mesh]
        boxes = world_boxes(mesh.bounds, drawable.world_from_object)
        placements = drawable.world_from_object[_near(boxes, centre, radius)]
        if len(placements) * len(mesh.triangles) > _MOST_TRIANGLES:
            return True
        if _near(_triangle_boxes(mesh, placements), centre, radius).any():
            return True
    return False


def _near(boxes: NDArray[np.float64], centre: NDArray[np.float64], radius: float) -> NDArray[np.bool_]:
    """(N,) of boxes (N, 2, 3); those that are not finite are nowhere."""
    with np.errstate(invalid="ignore"):
        apart = np.maximum(np.maximum(boxes[:, 0] - centre, centre - boxes[:, 1]), 0.0)
        return np.einsum("ni,ni->n", apart, apart) < radius**2


def _triangle_boxes(mesh: Mesh, placements: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N T, 2, 3) in world space."""
    points = mesh.points @ placements[:, :3, :3].transpose(0, 2, 1) + placements[:, None, :3, 3]
    corners = points[:, mesh.triangles]
    return np.stack([corners.min(axis=2), corners.max(axis=2)], axis=2).reshape(-1, 2, 3)
