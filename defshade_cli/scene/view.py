"""How large things are in the picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.camera import Camera


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What a pixel is. camera: conformed to the image.  height: of the image, pixels."""

    camera: Camera
    height: int

    def pixels_per_unit(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N,) how large a unit may appear in world-space boxes (N, 2, 3): at their points nearest to the eye."""
        eye = self.camera.position
        apart = np.maximum(np.maximum(boxes[:, 0] - eye, eye - boxes[:, 1]), 0.0)
        return self.pixels_at(np.linalg.norm(apart, axis=1))

    def pixels_at(self, depth: NDArray[np.float64]) -> NDArray[np.float64]:
        """(...) how large a unit across the view appears so far ahead of the eye."""
        _, _, bottom, top = self.camera.window
        scale = self.height / (top - bottom)
        if self.camera.projection == "orthographic":
            return np.full(depth.shape, scale)
        return scale / np.maximum(depth, self.camera.clipping_range[0])

    def seen(self, points: NDArray[np.float64], beyond: float) -> NDArray[np.float64]:
        """(N, 2) where points (N, 3) in camera space are in the image, in pixels from its middle.

        What is out of it is held where it is `beyond` times as far off the middle as the edge.
        """
        left, right, bottom, top = self.camera.window
        depth = np.ones(len(points)) if self.camera.projection == "orthographic" else -points[:, 2]
        half = 0.5 * np.array([right - left, top - bottom])
        middle = 0.5 * np.array([left + right, bottom + top])
        with np.errstate(divide="ignore", invalid="ignore"):
            place = (points[:, :2] / depth[:, None] - middle) / half
        held = np.clip(np.nan_to_num(place), -beyond, beyond)
        return held * (0.5 * self.height) * np.array([self.camera.aspect, 1.0])
