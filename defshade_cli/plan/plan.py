"""What one frame needs, and what it skips and why: decided once, before anything is drawn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import UsageError
from defshade_cli.gpu.planes import MOST_PRIMVARS, MOST_TARGETS, Plane, named_planes, needed_planes
from defshade_cli.image.layers import BEAUTY, LAYERS, PRIMVAR_FAMILY, resolve
from defshade_cli.image.ocio import find_render_space
from defshade_cli.image.render_space import RenderSpace
from defshade_cli.plan.closed_casters import closed_casters
from defshade_cli.plan.cost import choose_lighting
from defshade_cli.plan.decisions import Decision, explain
from defshade_cli.plan.groups import light_groups, light_outputs
from defshade_cli.plan.lights import PlannedLight, plan_lights
from defshade_cli.plan.lobe_rays import roughest_rays, seen_by_rays
from defshade_cli.plan.moments import count_moments, share_moments
from defshade_cli.plan.opacity import is_transparent, thin_materials, thin_numbers
from defshade_cli.plan.points import cell_parts, rays_a_sample
from defshade_cli.plan.redrawing import WHOLE, Redrawing, find_redrawing
from defshade_cli.plan.shadow_maps import ATLAS, MOST_KEPT, count_maps, shadow_resolution
from defshade_cli.plan.solidity import solid_materials
from defshade_cli.plan.texels import seen_texels
from defshade_cli.scene.camera import Camera, image_size
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.shadow import PLAIN
from defshade_cli.scene.texture import Texture
from defshade_cli.scene.view import View
from defshade_cli.scene.window import DataWindow, from_ndc
from defshade_cli.settings import FILTERS, Complexity, Debug, Filter, Layout, Lighting, RenderSettings, Shading
from defshade_cli.spaces import transform_points
from defshade_cli.units import exposure_scale

if TYPE_CHECKING:
    from defshade_cli.scene.ies import IesProfile

_MARGIN = 1e-3  # relative slack around bounds that float32 may round outwards


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """All that the passes read beside the Scene.

    display, display_camera: the whole image, and the camera conformed to it.
    window: the part of it that is rendered; size and camera are its own.
    clip: (near, far), the camera's range tightened to the geometry's roomy bounds.
    render_space: of light and reflectance.
    exposure: linear, the camera's and the settings' together.
    samples: a pixel at most.  cell_parts: see plan/points.py.  max_error, time_limit: of RenderSettings.
    filter_width: pixels.
    moments: of the shutter that the samples see, in turn; 0 without motion blur.
    planes: of the GBuffer that samples are lit from; data_planes: of the data layers.
    lights: sorted quads, spheres, cones.  lighting: how they are drawn.
    shadows: some light casts them.  shadow_linked: in some light not all geometry does.
    lobe_rays: of a pixel in a sample, by which lobes see some lights; 0 where they see none so.
    roughest_rays: roughness of surfaces from which on they see none so.
    background: domes are seen where no geometry is.
    thin: numbers of the materials whose opacity may be below 1.  transparent: it scales the diffuse of some alone.
    closed: numbers of the drawables that show shadow maps their fronts alone.
    solid: how many have opacity from an image that is 1 where they read it, see plan/solidity.py.
    texels: of each texture that is read, a side that it is worth, see plan/texels.py.
    data_pass: data layers need an unjittered float GBuffer of their own.
    portals: how many hints for sampling domes the stage has.
    levels: how often subdivision surfaces were refined, ascending; empty without any.
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
    samples: int
    cell_parts: int
    max_error: float | None
    time_limit: float | None
    moments: int
    filter: Filter
    filter_width: float
    layers: tuple[str, ...]
    planes: tuple[Plane, ...]
    data_planes: tuple[Plane, ...]
    lights: tuple[PlannedLight, ...]
    lighting: Lighting
    shadows: bool
    shadow_linked: bool
    lobe_rays: int
    roughest_rays: float
    background: bool
    thin: tuple[int, ...]
    closed: tuple[int, ...]
    solid: int
    transparent: bool
    texels: Mapping[Texture, float]
    data_pass: bool
    complexity: Complexity
    portals: int
    levels: tuple[int, ...]
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
    def textures(self) -> bool:
        """Does some material read them?"""
        return bool(self.texels)

    @property
    def cutout(self) -> bool:
        """Is something drawn that may let through what lies behind it?"""
        return bool(self.thin)

    @property
    def lit(self) -> bool:
        """Does any layer need the lighting?"""
        return _has_light(self.layers)

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
    def most_groups(self) -> int:
        """Groups that a light is in."""
        return max((len(planned.groups) for planned in self.lights), default=0)

    @property
    def mattes(self) -> tuple[str, ...]:
        """The layers that are Cryptomattes."""
        return tuple(name for name in self.layers if LAYERS[name].source == "matte")

    @property
    def domes(self) -> tuple[PlannedLight, ...]:
        """Those of the lights that are skies."""
        return tuple(planned for planned in self.lights if isinstance(planned.light, DomeLight))

    @property
    def lamps(self) -> tuple[PlannedLight, ...]:
        """Those of the lights that have a place or a size, and that lobes see by rays, groups together."""
        seen = [planned for planned in self.lights if planned.by_rays and not isinstance(planned.light, DomeLight)]
        return tuple(sorted(seen, key=lambda planned: planned.groups))

    @property
    def sky_share(self) -> float:
        """Of a dome, that one of its directions stands for, four times; 0 where it has none but its analytic term."""
        directions = max((dome.points for dome in self.domes), default=0) * self.samples
        return 4.0 / directions if directions else 0.0

    def hides_sky(self, planned: PlannedLight) -> bool:
        """Is it a dome that geometry hides, as far as the directions drawn so far tell? Rays need not ask them."""
        return self.shadows_sky(planned) and not planned.by_rays

    def shadows_sky(self, planned: PlannedLight) -> bool:
        """Is it a dome with directions that geometry hides?"""
        casts = self.shadows and planned.light.casts_shadow
        return isinstance(planned.light, DomeLight) and planned.points > 0 and casts

    @property
    def shadows_lamps(self) -> bool:
        """Does geometry hide some of the lamps?"""
        return self.shadows and any(planned.light.casts_shadow for planned in self.lamps)

    @property
    def shadow_styles(self) -> bool:
        """Are some shadows other than black, or do they end?"""
        return self.shadows and any(p.light.casts_shadow and p.light.shadow != PLAIN for p in self.lights)

    @property
    def shadow_resolution(self) -> int:
        """Texels along the side of each shadow map."""
        return shadow_resolution(self.lights, self.samples, thin=self.cutout)

    @property
    def maps_a_sample(self) -> int:
        """Shadow maps that a sample may need."""
        return sum(map(count_maps, self.lights))

    @property
    def keeps_maps(self) -> bool:
        """Are its shadow maps so few that those of the next frame are drawn where they change?"""
        texels = self.maps_a_sample * self.shadow_resolution**2
        sees_alike = self.samples == 1 and not self.lobe_rays and self.lighting != "volumes"
        return self.shadows and sees_alike and texels <= MOST_KEPT * ATLAS**2

    @property
    def profiles(self) -> tuple[IesProfile, ...]:
        """The IES profiles of the lights, each once."""
        shapings = [planned.light.shaping for planned in self.lights]
        return tuple(dict.fromkeys(shaping.ies for shaping in shapings if shaping and shaping.ies))

    @property
    def decisions(self) -> tuple[Decision, ...]:
        """What was kept and what skipped, each with its reason."""
        return tuple(explain(self))


def make_plan(scene: Scene, settings: RenderSettings) -> Plan:
    """Decide. Raises UsageError for a layer or a render space that does not exist, or an image without pixels."""
    layers = resolve(settings.layers or (BEAUTY,))
    display = image_size(scene.camera.aspect, settings.size, settings.width, scene.resolution)
    display_camera = scene.camera.conformed(display[0] * scene.pixel_aspect / display[1], scene.conform)
    window = DataWindow(*settings.crop) if settings.crop else from_ndc(scene.data_window, display)
    camera = replace(display_camera, window=window.of(display_camera.window, display))
    exposure = camera.exposure * exposure_scale(settings.exposure)
    lights = _seen_lights(plan_lights(scene, exposure, settings, layers), layers)
    solid = solid_materials(scene)
    thin = thin_materials(scene, solid)
    thin_ones = thin_numbers(scene, thin)
    if _has_light(layers):
        lights = seen_by_rays(lights, scene, settings, thin=bool(thin))
    planes, data_planes, data_pass = _divide_planes(scene, settings, layers, thin)
    shadows = settings.shadows and bool(scene.drawables) and any(p.light.casts_shadow for p in lights)
    return Plan(
        display=display,
        display_camera=display_camera,
        window=window,
        camera=camera,
        clip=_tight_clip(camera, scene.roomy_bounds),
        render_space=find_render_space(settings.render_space or scene.rendering_space, settings.ocio),
        exposure=exposure,
        layout=settings.layout,
        shading=settings.shading,
        samples=settings.most_samples,
        cell_parts=cell_parts(settings),
        max_error=settings.max_error,
        time_limit=settings.time_limit,
        moments=count_moments(scene, settings),
        filter=settings.filter,
        filter_width=settings.filter_width or FILTERS[settings.filter],
        layers=layers,
        planes=planes,
        data_planes=data_planes,
        lights=lights,
        lighting=choose_lighting(lights, camera, settings, layers, window.width * window.height),
        shadows=shadows,
        shadow_linked=shadows and scene.shadow_linked,
        lobe_rays=rays_a_sample(settings) if any(planned.by_rays for planned in lights) else 0,
        roughest_rays=roughest_rays(lights, scene),
        background=settings.background,
        thin=thin_ones,
        closed=closed_casters(scene, lights, settings.most_samples, thin_ones) if shadows else (),
        solid=len(solid),
        transparent=is_transparent(thin, settings.shading),
        texels=seen_texels(scene, View(display_camera, display[1])),
        data_pass=data_pass,
        complexity=settings.complexity,
        ranks=settings.cryptomatte_levels,
        debug=settings.debug,
        portals=len(scene.portals),
        levels=tuple(sorted({mesh.level for mesh in scene.meshes if mesh.level is not None})),
    )


def plan_after(before: Scene, planned: Plan, scene: Scene, plan: Plan) -> Plan:
    """The plan of `scene`, where the frame before was planned too and is kept."""
    return replace(plan, redrawing=find_redrawing(before, planned, scene, plan))


ShutterSample = tuple[Scene, Plan]
"""What is there while the shutter is open, at one time."""


def plan_moments(plan: Plan, seen: Iterator[Scene], settings: RenderSettings) -> Iterator[ShutterSample]:
    """What the samples see in turn: `seen` with plans that fill the same planes, of the same texels.

    Raises as make_plan: UsageError.
    """
    for moment in seen:
        planned = make_plan(moment, settings)
        yield moment, replace(planned, planes=plan.planes, transparent=plan.transparent, texels=plan.texels)


def _has_light(layers: tuple[str, ...]) -> bool:
    return any(LAYERS[name].source == "lighting" for name in layers)


def _seen_lights(lights: tuple[PlannedLight, ...], layers: tuple[str, ...]) -> tuple[PlannedLight, ...]:
    """All lights for a lit layer; for mere coverage the domes, which cover what is behind the geometry."""
    if _has_light(layers):
        return lights
    return tuple(planned for planned in lights if isinstance(planned.light, DomeLight))


def primvar_names(layers: tuple[str, ...]) -> tuple[str, ...]:
    """Of the layers that show primvars, these."""
    return tuple(name.removeprefix(PRIMVAR_FAMILY) for name in layers if name.startswith(PRIMVAR_FAMILY))


def _divide_planes(
    scene: Scene, settings: RenderSettings, layers: tuple[str, ...], thin: tuple[Material, ...]
) -> tuple[tuple[Plane, ...], tuple[Plane, ...], bool]:
    """Planes of the samples' GBuffer, planes of the data layers, and whether these need a GBuffer of their own.

    One exact sample at the pixels' centres serves both, unless it is jittered, quantised or dithered, or the planes
    are too many.
    """
    rows = [LAYERS[name] for name in layers]
    lit = _lit_planes(scene, settings, thin) if any(row.source == "lighting" for row in rows) else ()
    lit += named_planes("visible" for row in rows if row.source == "matte")
    shown = primvar_names(layers)
    if len(shown) > MOST_PRIMVARS:
        raise UsageError(f"{len(shown)} primvars are asked for as layers, and {MOST_PRIMVARS} can be shown at once")
    data = named_planes([row.source for row in rows] + [f"primvar_{i}" for i in range(len(shown))])
    both = named_planes(plane.name for plane in (*lit, *data))
    sampled, has_data = any(row.is_sampled for row in rows), not all(row.is_sampled for row in rows)
    exact = settings.layout == "float" and settings.most_samples == 1 and not thin and len(both) <= MOST_TARGETS
    data_pass = has_data and not (sampled and exact)
    return (lit if data_pass or not has_data else both), data, data_pass


def _lit_planes(scene: Scene, settings: RenderSettings, thin: tuple[Material, ...]) -> tuple[Plane, ...]:
    names = [plane.name for plane in needed_planes(scene.materials)]
    weights = ["weights"] * is_transparent(thin, settings.shading)
    return named_planes([*names, *["links"] * scene.light_linked, *weights])


def _tight_clip(camera: Camera, bounds: NDArray[np.float64]) -> tuple[float, float]:
    """The camera's clipping range without the empty space before and behind the geometry."""
    near, far = camera.clipping_range
    if not np.isfinite(bounds).all():
        return near, far
    depth = -transform_points(camera.camera_from_world, np.array(list(product(*bounds.T))))[:, 2]
    slack = _MARGIN * float(np.abs(depth).max())
    tight = max(near, float(depth.min()) - slack), min(far, float(depth.max()) + slack)
    return tight if tight[0] < tight[1] else (near, far)
