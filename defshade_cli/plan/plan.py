"""What one frame needs, and what it skips and why: decided once, before anything is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from defshade_cli.errors import UsageError
from defshade_cli.gpu.planes import Plane, needed_planes
from defshade_cli.image.layers import LAYERS
from defshade_cli.plan.decisions import Decision, explain
from defshade_cli.plan.lights import PlannedLight, Volume, plan_lights
from defshade_cli.scene.camera import Camera, image_size
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import FILTERS, MOST_SAMPLES, Complexity, Filter, Layout, RenderSettings, Shading
from defshade_cli.spaces import transform_points
from defshade_cli.units import exposure_scale

_MARGIN = 1e-3  # relative slack around bounds that float32 may round outwards


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """All that the passes read beside the Scene.

    camera: conformed to the image.  clip: (near, far), the camera's range tightened to the geometry.
    exposure: linear, the camera's and the settings' together.
    samples: a pixel at most.  max_error, time_limit: of RenderSettings.  filter_width: pixels.
    planes: of the GBuffer; lights: sorted quads, spheres, cones.
    shadows: some light casts them.  background: domes are seen where no geometry is.
    cutout: some opacity may be below 1.  textures: some material reads them.
    data_pass: data layers need an unjittered float GBuffer of their own.
    levels: how often subdivision surfaces were refined, ascending; empty without any.
    """

    size: tuple[int, int]
    camera: Camera
    clip: tuple[float, float]
    exposure: float
    layout: Layout
    shading: Shading
    samples: int
    max_error: float | None
    time_limit: float | None
    filter: Filter
    filter_width: float
    layers: tuple[str, ...]
    planes: tuple[Plane, ...]
    lights: tuple[PlannedLight, ...]
    shadows: bool
    background: bool
    cutout: bool
    textures: bool
    data_pass: bool
    complexity: Complexity
    levels: tuple[int, ...]

    @property
    def lit(self) -> bool:
        """Does any layer need the lighting?"""
        return any(LAYERS[name].source == "lighting" for name in self.layers)

    @property
    def tracks_error(self) -> bool:
        """Is the error of the mean asked for?"""
        asked = self.max_error is not None or self.time_limit is not None or "variance" in self.layers
        return self.lit and self.samples > 1 and asked

    @property
    def domes(self) -> tuple[DomeLight, ...]:
        return tuple(planned.light for planned in self.lights if isinstance(planned.light, DomeLight))

    @property
    def volumes(self) -> tuple[Volume, ...]:
        """The kinds of volume that some light has, in the order of the lights."""
        return tuple(dict.fromkeys(planned.volume for planned in self.lights))

    @property
    def passes(self) -> tuple[str, ...]:
        """Names of the passes in the order of the pipeline."""
        before = ("gbuffer", "emission", *("environment",) * bool(self.domes), *("shadow maps",) * self.shadows)
        lighting = before + tuple(f"light {volume}" for volume in self.volumes)
        accumulation = ("accumulation",) * (self.samples > 1) + ("batch means",) * self.tracks_error
        data = ("data gbuffer",) * (self.data_pass or not self.lit)
        return (lighting + accumulation if self.lit else ()) + data

    @property
    def decisions(self) -> tuple[Decision, ...]:
        """What was kept and what skipped, each with its reason."""
        return tuple(explain(self))


def make_plan(scene: Scene, settings: RenderSettings) -> Plan:
    """Decide. Raises UsageError for a layer that does not exist or an image without pixels."""
    _check_layers(settings.layers)
    size = image_size(scene.camera.aspect, settings.size, settings.width, scene.resolution)
    camera = scene.camera.conformed(size[0] * scene.pixel_aspect / size[1], scene.conform)
    exposure = camera.exposure * exposure_scale(settings.exposure)
    lights = plan_lights(scene, exposure, settings)
    planes = needed_planes(scene.materials, settings.layers)
    cutout = _has_cutout(scene)
    shadows = settings.shadows and bool(scene.drawables) and any(p.light.casts_shadow for p in lights)
    samples = settings.samples or (MOST_SAMPLES if settings.max_error or settings.time_limit else 1)
    data_layers = [name for name in settings.layers if LAYERS[name].source != "lighting"]
    data_pass = bool(data_layers) and (settings.layout != "float" or samples > 1 or cutout)
    return Plan(
        size=size,
        camera=camera,
        clip=_tight_clip(camera, scene.bounds),
        exposure=exposure,
        layout=settings.layout,
        shading=settings.shading,
        samples=samples,
        max_error=settings.max_error,
        time_limit=settings.time_limit,
        filter=settings.filter,
        filter_width=settings.filter_width or FILTERS[settings.filter],
        layers=settings.layers,
        planes=planes,
        lights=lights,
        shadows=shadows,
        background=settings.background,
        cutout=cutout,
        textures=bool(scene.textures),
        data_pass=data_pass,
        complexity=settings.complexity,
        levels=tuple(sorted({mesh.level for mesh in scene.meshes if mesh.level is not None})),
    )


def _check_layers(names: tuple[str, ...]) -> None:
    unknown = [name for name in names if name not in LAYERS]
    if unknown or not names:
        raise UsageError(f"no layer named {', '.join(unknown) or '(none given)'}; there are {', '.join(LAYERS)}")


def _has_cutout(scene: Scene) -> bool:
    if any(m.opacity < 1.0 or m.opacity_threshold > 0.0 or "opacity" in m.inputs for m in scene.materials):
        return True
    varying = [m.display_opacity for m in scene.meshes if m.display_opacity is not None]
    constant = [d.display_opacity for d in scene.drawables]
    return any(m.uses_display_color for m in scene.materials) and any((o < 1.0).any() for o in varying + constant)


def _tight_clip(camera: Camera, bounds: NDArray[np.float64]) -> tuple[float, float]:
    """The camera's clipping range without the empty space before and behind the geometry."""
    near, far = camera.clipping_range
    if not np.isfinite(bounds).all():
        return near, far
    depth = -transform_points(camera.camera_from_world, np.array(list(product(*bounds.T))))[:, 2]
    slack = _MARGIN * float(np.abs(depth).max())
    tight = max(near, float(depth.min()) - slack), min(far, float(depth.max()) + slack)
    return tight if tight[0] < tight[1] else (near, far)
