"""The camera: a rigid frame, a window and a depth range."""

from __future__ import annotations

from dataclasses import field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import UsageError
from defshade_cli.scene.arrays import frozen
from defshade_cli.spaces import ConformPolicy, Matrix, Window, conform_window, inverse_rigid

Projection = Literal["perspective", "orthographic"]


DEFAULT_SIZE = (1920, 1080)


def image_size(
    aspect: float,
    asked: tuple[int, int] | None = None,
    width: int | None = None,
    authored: tuple[int, int] | None = None,
) -> tuple[int, int]:
    """(width, height): as asked, else the stage's, else 1920x1080; a width alone takes the camera's `aspect`.

    Raises UsageError for an image without pixels.
    """
    size = asked or authored or DEFAULT_SIZE
    if width is not None:
        size = (width, max(1, round(width / aspect)))
    if min(size) < 1:
        raise UsageError(f"an image of {size[0]}x{size[1]} has no pixels")
    return size


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A camera as UsdGeomCamera describes it, in scene units.

    path: prim path, or a name in angle brackets for a camera of ours.
    world_from_camera: (4, 4) float64, rigid.
    window: (left, right, bottom, top) of the image on the plane one unit ahead (perspective: tangents of the
        view angles; orthographic: scene units).
    clipping_range: (near, far), 0 < near < far in perspective.
    exposure: linear scale of the camera's exposure attributes (UsdGeomCamera.ComputeLinearExposureScale).
    f_stop, focus_distance, focal_length: lens; f_stop 0 is a pinhole.
    shutter: (open, close) in time codes around the frame.
    clipping_planes: (N, 4) float64 in camera space: a point p is seen where no plane · (p, 1) is negative.
    """

    path: str
    world_from_camera: Matrix
    window: Window
    projection: Projection = "perspective"
    clipping_range: tuple[float, float] = (1.0, 1.0e6)
    exposure: float = 1.0
    f_stop: float = 0.0
    focus_distance: float = 0.0
    focal_length: float = 0.0
    shutter: tuple[float, float] = (0.0, 0.0)
    clipping_planes: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 4)))

    def __post_init__(self) -> None:
        object.__setattr__(self, "world_from_camera", frozen(self.world_from_camera, np.float64, 4, 4))
        object.__setattr__(self, "clipping_planes", frozen(self.clipping_planes, np.float64, -1, 4))

    def shutter_times(self, count: int) -> tuple[float, ...]:
        """The middles of `count` equal parts of the shutter, in time codes around the frame.

        In the order of van der Corput's sequence: any first few are spread over the whole shutter.
        """
        opens, closes = self.shutter
        parts = sorted(range(count), key=lambda part: f"{part:032b}"[::-1])
        return tuple(opens + (closes - opens) * (part + 0.5) / count for part in parts)

    @property
    def position(self) -> NDArray[np.float64]:
        """(3,) the eye in world space."""
        return self.world_from_camera[:3, 3]

    @property
    def camera_from_world(self) -> Matrix:
        """(4, 4) float64, the inverse of where the camera stands."""
        return inverse_rigid(self.world_from_camera)

    @property
    def aspect(self) -> float:
        """Width of the window over its height."""
        left, right, bottom, top = self.window
        return (right - left) / (top - bottom)

    @property
    def lens_radius(self) -> float:
        """Scene units; zero for a pinhole, an orthographic camera, or one without a focus distance."""
        if self.f_stop <= 0.0 or self.focus_distance <= 0.0 or self.projection != "perspective":
            return 0.0
        return 0.5 * self.focal_length / self.f_stop

    def conformed(self, aspect: float, policy: ConformPolicy = "expandAperture") -> Camera:
        """This camera with its window fitted to an image of `aspect`."""
        return replace(self, window=conform_window(self.window, aspect, policy))
