"""Who looks: a camera of the stage, or one of ours around all of it; and at an image of which size."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from defshade_cli.scene.camera import Camera, image_size
from defshade_cli.scene.geometry import enclose, world_boxes
from defshade_cli.scene.scene import Unsupported
from defshade_cli.scene.view import View
from defshade_cli.spaces import Window, conform_window
from defshade_cli.usd.camera import choose_camera, default_window, framed_camera, read_camera
from defshade_cli.usd.facing import PlacedSurface
from defshade_cli.usd.opening import stage as facts
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.render_settings.settings import StageSettings
from defshade_cli.usd.surfaces.extent import extents_of


class Sight:
    """Of one stage, frame after frame.

    cameras: paths of all that the stage has. Raises PrimNotFound for one that it lacks.
    """

    def __init__(
        self, stage: Usd.Stage, settings: StageSettings, cameras: tuple[str, ...], options: ReadOptions
    ) -> None:
        self._stage, self._settings, self._options = stage, settings, options
        self._framing = options.framing
        self._camera = None if self._framing else choose_camera(stage, cameras, options.camera, settings.camera)
        self._bounds_at_start: NDArray[np.float64] | None = None

    @property
    def name(self) -> str:
        """The prim name of the camera; `framed`, `fit` or `turntable` for ours."""
        if self._framing:
            return self._framing.name
        return self._camera.GetName() if self._camera else "framed"

    @property
    def turns(self) -> bool:
        """Does a camera of ours go around what it looks at?"""
        return self._framing is not None and self._framing.turn is not None

    def camera(
        self,
        frame: float | None,
        time: Usd.TimeCode,
        placed: Sequence[PlacedSurface],
        placed_at: Callable[[Usd.TimeCode], Sequence[PlacedSurface]],
    ) -> tuple[Camera, tuple[Unsupported, ...]]:
        """The camera at a time, and what is to say of it. placed: what is drawn then; placed_at: at any other.

        Raises StageError for one that sees nothing.
        """
        if self._framing:
            bounds = self._bounds_of_turn(placed_at) if self._framing.turn else self._bounds(placed, time)
            return self._framing.camera(bounds, facts.up_axis(self._stage), self._window, frame), ()
        if self._camera is None:
            return framed_camera(self._bounds(placed, time), facts.up_axis(self._stage)), ()
        camera, issues = read_camera(self._camera, time)
        return self._settings.applied_to(camera), issues

    def view(self, camera: Camera) -> View:
        """How the image shows what the camera sees."""
        width, height = self._image_size(camera.aspect)
        aspect = width * self._settings.pixel_aspect_for(camera) / height
        return View(camera.conformed(aspect, self._settings.conform), height)

    @property
    def _window(self) -> Window:
        """Of a camera of ours whose image has the shape that is asked for."""
        window = default_window()
        width, height = self._image_size((window[1] - window[0]) / (window[3] - window[2]))
        return conform_window(window, width / height)

    def _image_size(self, aspect: float) -> tuple[int, int]:
        return image_size(aspect, self._options.size, self._options.width, self._settings.resolution)

    def _bounds_of_turn(self, placed_at: Callable[[Usd.TimeCode], Sequence[PlacedSurface]]) -> NDArray[np.float64]:
        """(2, 3) at the stage's first frame: a turn shall not sway with what moves."""
        if self._bounds_at_start is None:
            start = facts.first_frame(self._stage)
            time = Usd.TimeCode.Default() if start is None else Usd.TimeCode(start)
            self._bounds_at_start = self._bounds(placed_at(time), time)
        return self._bounds_at_start

    def _bounds(self, placed: Sequence[PlacedSurface], time: Usd.TimeCode) -> NDArray[np.float64]:
        """(2, 3) around the surfaces as authored, however they are refined, empty ones too."""
        extents = extents_of(self._stage, [surface for _, surface in placed], time)
        boxes = np.repeat(extents, [len(piece.root_from_object) for piece, _ in placed], axis=0)
        matrices = np.concatenate([np.empty((0, 4, 4)), *(piece.root_from_object for piece, _ in placed)])
        return enclose([world_boxes(boxes, matrices)])
