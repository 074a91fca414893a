"""One frame of a stage: everything a renderer needs to know, in NumPy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, fields
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.geometry import Drawable, Mesh, enclose, world_boxes
from defshade_cli.scene.light import Light
from defshade_cli.scene.material import Material
from defshade_cli.scene.texture import Texture
from defshade_cli.scene.window import WHOLE_IMAGE
from defshade_cli.spaces import ConformPolicy

if TYPE_CHECKING:
    from defshade_cli.scene.motion import Moment

_GRID_BITS = 6
"""Steps of `roomy_bounds`: between a 64th and a 128th of the longest side."""


@dataclass(frozen=True, slots=True)
class Unsupported:
    """A prim, or a part of one, that is left out of the picture, and why in a few words."""

    path: str
    reason: str


@dataclass(frozen=True, eq=False)
class Scene:
    """A stage at one time code, in world space and scene units.

    camera: the one to render; cameras: the paths of all that the stage has.
    portals: paths of the PortalLights, hints for sampling domes.
    frame: time code, None for the default time.  moves: something may differ while the shutter is open.
    labels: path of a drawn prim → its semantic labels, such as `class:chair,furniture`; empty unless asked for.
    neighbours: a frame before and a frame after; empty unless asked for, and at the default time.
    assets: path of a drawn prim → path of the component that it is part of; empty unless asked for.
    resolution, pixel_aspect, conform, data_window: of the stage's UsdRenderSettings, where it names one; the window
        is (xmin, ymin, xmax, ymax), 0..1 over the image, y up.
    lit_by: whose the lights are: the `stage`'s, or ours, a `camera light` or a `studio`.
    purposes: of what is drawn.
    rendering_space: the colour space that they name; None for linear Rec.709, in which a Scene's colours are.
    """

    name: str
    meshes: tuple[Mesh, ...]
    drawables: tuple[Drawable, ...]
    materials: tuple[Material, ...]
    lights: tuple[Light, ...]
    camera: Camera
    cameras: tuple[str, ...] = ()
    portals: tuple[str, ...] = ()
    unsupported: tuple[Unsupported, ...] = ()
    meters_per_unit: float = 0.01
    up_axis: str = "Y"
    frame: float | None = None
    moves: bool = False
    frames_per_second: float = 24.0
    resolution: tuple[int, int] | None = None
    pixel_aspect: float = 1.0
    assets: Mapping[str, str] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    neighbours: tuple[Moment, ...] = ()
    conform: ConformPolicy = "expandAperture"
    data_window: tuple[float, float, float, float] = WHOLE_IMAGE
    purposes: tuple[str, ...] = ("default", "render")
    rendering_space: str | None = None
    lit_by: str = "stage"

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) world-space box around every drawable; (+inf, −inf) for a scene without geometry."""
        return enclose([self.drawable_bounds])

    @property
    def is_empty(self) -> bool:
        """Is there nothing to draw?"""
        return bool((self.bounds[0] > self.bounds[1]).any())

    @cached_property
    def roomy_bounds(self) -> NDArray[np.float64]:
        """(2, 3) around `bounds`, on a coarse grid: what is fitted to it stays while things move a little."""
        extent = float(np.ptp(self.bounds, axis=0).max())
        if not (np.isfinite(extent) and extent > 0.0):
            return self.bounds
        step = 2.0 ** (np.floor(np.log2(extent)) - _GRID_BITS)
        return np.stack([np.floor(self.bounds[0] / step), np.ceil(self.bounds[1] / step)]) * step

    @cached_property
    def drawable_bounds(self) -> NDArray[np.float64]:
        """(D, 2, 3) world-space box around all placements of each drawable; (+inf, −inf) around none."""
        boxes = [world_boxes(self.meshes[d.mesh].bounds, d.world_from_object) for d in self.drawables]
        return np.array([enclose([box]) for box in boxes]).reshape(-1, 2, 3)

    def is_still(self, before: Scene) -> bool:
        """Is all of it the very objects of `before`, but for the frame?"""
        kept = (f.name for f in fields(self) if f.name != "frame")
        return all(getattr(self, name) is getattr(before, name) for name in kept)

    @property
    def light_linked(self) -> bool:
        """Does some light leave geometry unlit?"""
        return any(light.links and not light.links.lights.all() for light in self.lights)

    @property
    def shadow_linked(self) -> bool:
        """Is there geometry that casts no shadow in some light?"""
        return any(light.links and not light.links.casts.all() for light in self.lights)

    @cached_property
    def textures(self) -> tuple[Texture, ...]:
        """All that the materials read, each once."""
        return tuple(dict.fromkeys(i.texture for material in self.materials for i in material.inputs.values()))

    @cached_property
    def triangle_count(self) -> int:
        """Triangles drawn, every instance counted."""
        return sum(
            sum(subset.count for subset in drawable.subsets) * len(drawable.world_from_object)
            for drawable in self.drawables
        )
