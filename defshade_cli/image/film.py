"""A finished frame in CPU memory: named layers, the camera that saw them and what the render cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.image.layers import BEAUTY, LAYERS, Layer
from defshade_cli.image.render_space import REC709, RenderSpace
from defshade_cli.scene.camera import Camera
from defshade_cli.settings import NamedLayer

StopReason = Literal["samples", "max-error", "time-limit"]


@dataclass(frozen=True, slots=True)
class Sampling:
    """Samples that pixels got, and why they got no more.

    error: relative standard error that 95 % of the tiles keep; None where it is not known.
    """

    least: int
    mean: float
    most: int
    error: float | None = None
    stopped_by: StopReason = "samples"

    @property
    def facts(self) -> dict[str, Any]:
        """For the file's header and `--stats`."""
        facts = {"samples": self.most, "samples_min": self.least, "samples_mean": round(self.mean, 2)}
        return facts | {"error": self.error, "stopped_by": self.stopped_by}


@dataclass(frozen=True, slots=True, eq=False)
class Film:
    """One frame.

    layers: name → (height, width, channels) float32, first row at the top.
    rows: what each name means, and its channels; the table of all layers, unless a file has names of its own.
    camera: conformed to the image's aspect.
    scene_name: the stage's file name without suffix; frame: time code, None for the default time.
    render_space: of light and reflectance.
    samples: a pixel.
    origin: (x, y) of the first pixel in the display window, from its top left corner, y down.
    display: (width, height) of the display window that the camera fills; None where that is the layers' own size.
    shown: (name, with alpha) → colour layers that a display transform has been applied to, in [0, 1] or bytes, alpha
        straight.
    manifests: of layers that hold ids: name of the layer → what each id stands for.
    metadata: further facts for the file's header and `--stats`, JSON-like values.
    """

    layers: dict[str, NDArray[np.float32]]
    camera: Camera
    scene_name: str
    frame: float | None = None
    frames_per_second: float = 24.0
    samples: int = 1
    rows: Mapping[str, Layer] = field(default_factory=lambda: LAYERS)
    render_space: RenderSpace = REC709
    origin: tuple[int, int] = (0, 0)
    display: tuple[int, int] | None = None
    manifests: dict[str, dict[int, str]] = field(default_factory=dict)
    shown: dict[tuple[str, bool], NDArray[np.float32] | NDArray[np.uint8]] = field(default_factory=dict)
    metadata: dict[str, Any] = field(default_factory=dict)

    def row(self, name: str) -> Layer:
        """The layer's row of the table, with as many channels as it has here."""
        return self.rows[name].of_width(self.layers[name].shape[2])

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the layers in pixels: of the data window."""
        height, width = next(iter(self.layers.values())).shape[:2]
        return width, height

    @property
    def display_size(self) -> tuple[int, int]:
        """(width, height) of the display window in pixels."""
        return self.display or self.size

    def under(self, variables: Sequence[NamedLayer]) -> Film:
        """The same with only these layers, under their names and in their widths; none leaves the film as it is.

        The first that is the beauty keeps its bare channels.
        """
        if not variables:
            return self
        main = next((v.name for v in variables if v.layer == BEAUTY), None)
        rows = {v.name: replace(self.rows[v.layer], name=BEAUTY if v.name == main else v.name) for v in variables}
        manifests = {v.name: self.manifests[v.layer] for v in variables if v.layer in self.manifests}
        layers = {v.name: self._narrowed(v) for v in variables}
        shown = {
            (v.name, alpha): self.shown[v.layer, alpha]
            for v in variables
            for alpha in (False, True)
            if (v.layer, alpha) in self.shown
        }
        return replace(self, layers=layers, rows=rows, manifests=manifests, shown=shown)

    def _narrowed(self, variable: NamedLayer) -> NDArray[np.float32]:
        """The variable's channels; a matte has all its ranks, whatever type it is declared with."""
        pixels = self.layers[variable.layer]
        return pixels if self.rows[variable.layer].source == "matte" else pixels[..., : max(variable.width, 1)]
