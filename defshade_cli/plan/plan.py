"""What one frame needs, decided before anything is drawn: all that the passes read beside the Scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.planes import Plane
from defshade_cli.image.layers import LAYERS
from defshade_cli.image.render_space import RenderSpace
from defshade_cli.plan.decisions import Decision, explain
from defshade_cli.plan.groups import light_groups, light_outputs
from defshade_cli.plan.light_plan import LightPlan
from defshade_cli.plan.moments import share_moments
from defshade_cli.plan.planes import is_lit, primvar_names
from defshade_cli.plan.redrawing import WHOLE, Redrawing
from defshade_cli.plan.shared_shadows import sharing_pixels
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.texture import Texture
from defshade_cli.scene.window import DataWindow
from defshade_cli.settings import Complexity, Debug, Filter, Layout, Shading


@dataclass(frozen=True, slots=True, eq=False)
class Plan(LightPlan):
    """All that the passes read beside the Scene: how it is lit, and how it is seen.

    display, display_camera: the whole image, and the camera conformed to it.
    window: the part of it that is rendered; size and camera are its own.
    clip: (near, far), the camera's range tightened to the geometry's roomy bounds.
    render_space: of light and reflectance.
    exposure: linear, the camera's and the settings' together.
    cell_parts: see plan/points.py.  max_error, time_limit: of RenderSettings.
    filter_width: pixels.
    moments: of the shutter that the samples see, in turn; 0 without motion blur.
    planes: of the GBuffer that samples are lit from; data_planes: of the data layers.
    transparent: some opacity below 1 scales the diffuse alone.
    solid: how many have opacity from an image that is 1 where they read it, see plan/solidity.py.
    texels: of each texture that is read, a side that it is worth, see plan/texels.py.
    data_pass: data layers need an unjittered float GBuffer of their own.
    levels: how often subdivision surfaces were refined, ascending; empty without any.
    coarse_solids: meshes of solids that have fewer segments, since they are small in the image.
    ranks: (id, coverage) pairs of a Cryptomatte.
    debug: of RenderSettings.
    redrawing: what the frame before leaves to draw.
    """

    display: tuple[int, int]
    display_camera: Camera
    window: DataWindow
    camera: Camera
    clip: tuple[float, float]
    render_space: RenderSpace
    exposure: float
    layout: Layout
    shading: Shading
    cell_parts: int
    max_error: float | None
    time_limit: float | None
    moments: int
    filter: Filter
    filter_width: float
    layers: tuple[str, ...]
    planes: tuple[Plane, ...]
    data_planes: tuple[Plane, ...]
    solid: int
    transparent: bool
    texels: Mapping[Texture, float]
    data_pass: bool
    complexity: Complexity
    levels: tuple[int, ...]
    coarse_solids: int
    ranks: int
    debug: Debug | None = None
    redrawing: Redrawing = WHOLE

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of what is rendered, in pixels."""
        return self.window.size

    def within(self, window: DataWindow) -> Plan:
        """The plan of a part of what is rendered, with its share of the time."""
        camera = replace(self.camera, window=window.of(self.display_camera.window, self.display))
        share = window.width * window.height / (self.window.width * self.window.height)
        limit = None if self.time_limit is None else self.time_limit * share
        return replace(self, window=window, camera=camera, time_limit=limit)

    @property
    def sharing_pixels(self) -> int:
        """How many share what they look up of a dome's shadows; 1 where each pixel asks for all."""
        if not self.shadows or "lightComplexity" in self.layers:  # which counts volumes
            return 1
        return sharing_pixels(self.lights, self.display)

    @property
    def textures(self) -> bool:
        """Does some material read them?"""
        return bool(self.texels)

    @property
    def lit(self) -> bool:
        """Does any layer need the lighting?"""
        return is_lit(self.layers)

    @property
    def tracks_error(self) -> bool:
        """Is the error of the mean asked for?"""
        asked = self.max_error is not None or self.time_limit is not None or "variance" in self.layers
        return self.sampled and self.samples > 1 and asked

    @property
    def samples_a_moment(self) -> int:
        """How many samples in a row see the same moment."""
        may_stop = self.max_error is not None or self.time_limit is not None
        return share_moments(self.samples, self.moments, may_stop=may_stop)

    @property
    def sampled(self) -> bool:
        """Is any layer a mean of samples?"""
        return any(LAYERS[name].is_sampled for name in self.layers)

    @property
    def data_layers(self) -> tuple[str, ...]:
        """Those read from planes at the pixels' centres."""
        return tuple(name for name in self.layers if not LAYERS[name].is_sampled)

    @property
    def inputs(self) -> frozenset[str]:
        """What the planes need of the vertices beside what lighting does."""
        return frozenset(name for plane in (*self.planes, *self.data_planes) for name in plane.inputs)

    @property
    def primvars(self) -> tuple[str, ...]:
        """Names of the primvars that layers show, in the order of their planes."""
        return primvar_names(self.layers)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Layers that the light volumes write beside their radiance."""
        return light_outputs(self.layers)

    @property
    def groups(self) -> tuple[str, ...]:
        """Layers that are sums of some lights."""
        return light_groups(self.layers)

    @property
    def mattes(self) -> tuple[str, ...]:
        """The layers that are Cryptomattes."""
        return tuple(name for name in self.layers if LAYERS[name].source == "matte")

    @property
    def decisions(self) -> tuple[Decision, ...]:
        """What was kept and what skipped, each with its reason."""
        return tuple(explain(self))
