"""What one frame needs, and what it skips and why: decided once, before anything is drawn.

Reach of a light. Outside its volume a light may add no more than its share of `light_tolerance` to a pixel, so that
all that is dropped stays below it. With the far field I/d² and a bound K on BRDF · NoL of the scene's materials,

    reach² = exposure · I_max · K · lights / light_tolerance,    K = 1/π + 1/(2π α³) + clearcoat/(2π αc³)

(GGX: D ≤ 1/(πα²); both visibility terms: V·NoL ≤ 1/(2α); F ≤ 1; the greatest K of the scene's materials). No light
reaches further than the geometry does.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from defshade_cli.errors import UsageError
from defshade_cli.gpu.planes import PLANES, Plane, needed_planes
from defshade_cli.image.layers import LAYERS
from defshade_cli.scene.camera import Camera, image_size
from defshade_cli.scene.light import DistantLight, DomeLight, Light
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import Complexity, Layout, RenderSettings, Shading
from defshade_cli.spaces import transform_points
from defshade_cli.units import exposure_scale

Volume = Literal["quad", "sphere", "cone"]

_MARGIN = 1e-3  # relative slack around bounds that float32 may round outwards
_MIN_ALPHA = 1e-4  # shaders/lib/constants.glsl


@dataclass(frozen=True, slots=True)
class Decision:
    """One thing the plan chose, and the fact it follows from."""

    subject: str
    choice: str
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class PlannedLight:
    """reach: radius of the volume in scene units, infinite for a quad."""

    light: Light
    volume: Volume
    reach: float


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """All that the passes read beside the Scene.

    camera: conformed to the image.  clip: (near, far), the camera's range tightened to the geometry.
    exposure: linear, the camera's and the settings' together.
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
        accumulation = ("accumulation",) * (self.samples > 1)
        data = ("data gbuffer",) * (self.data_pass or not self.lit)
        return (lighting + accumulation if self.lit else ()) + data

    @property
    def decisions(self) -> tuple[Decision, ...]:
        """What was kept and what skipped, each with its reason."""
        return tuple(_explain(self))


def make_plan(scene: Scene, settings: RenderSettings) -> Plan:
    """Decide. Raises UsageError for a layer that does not exist or an image without pixels."""
    _check_layers(settings.layers)
    size = image_size(scene.camera.aspect, settings.size, settings.width, scene.resolution)
    camera = scene.camera.conformed(size[0] * scene.pixel_aspect / size[1], scene.conform)
    exposure = camera.exposure * exposure_scale(settings.exposure)
    lights = _plan_lights(scene, exposure, settings)
    planes = needed_planes(scene.materials, settings.layers)
    cutout = _has_cutout(scene)
    shadows = settings.shadows and bool(scene.drawables) and any(p.light.casts_shadow for p in lights)
    data_layers = [name for name in settings.layers if LAYERS[name].source != "lighting"]
    data_pass = bool(data_layers) and (settings.layout != "float" or settings.samples > 1 or cutout)
    return Plan(
        size=size,
        camera=camera,
        clip=_tight_clip(camera, scene.bounds),
        exposure=exposure,
        layout=settings.layout,
        shading=settings.shading,
        samples=settings.samples,
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


def volume_of(light: Light) -> Volume:
    """Distant and dome lights → quad; a cone of at most 90° → cone; every other light → sphere."""
    if light.is_infinite:
        return "quad"
    return "cone" if light.shaping and light.shaping.cone_angle <= 90.0 else "sphere"


def _plan_lights(scene: Scene, exposure: float, settings: RenderSettings) -> tuple[PlannedLight, ...]:
    lit = [light for light in scene.lights if _peak(light) > 0.0]
    response = max((_greatest_response(m, settings.shading) for m in scene.materials), default=1.0)
    share = settings.light_tolerance / max(len(lit), 1)
    order: dict[str, int] = {"quad": 0, "sphere": 1, "cone": 2}
    planned = [
        PlannedLight(light, volume_of(light), _reach(light, scene.bounds, exposure * response / share)) for light in lit
    ]
    return tuple(sorted(planned, key=lambda p: order[p.volume]))


def _greatest_response(material: Material, shading: Shading) -> float:
    """K of this file's first lines, each lobe with its own α; the classic equation has no coat.

    What an image holds is not known here: it may be the worst.
    """
    lobes = [(1.0, 0.0 if "roughness" in material.inputs else material.roughness)]
    if shading == "preview-surface":
        amount = 1.0 if "clearcoat" in material.inputs else material.clearcoat
        lobes.append((amount, 0.0 if "clearcoat_roughness" in material.inputs else material.clearcoat_roughness))
    return sum(amount / max(roughness**2, _MIN_ALPHA) ** 3 for amount, roughness in lobes) / math.tau + 1.0 / math.pi


def _peak(light: Light) -> float:
    """What a point of the light can send one way: all of L · A, which no profile exceeds."""
    strength = light.irradiance if isinstance(light, DistantLight) else light.emission * light.power_scale
    return float(np.max(strength)) * max(light.diffuse, light.specular)


def _reach(light: Light, bounds: NDArray[np.float64], gain: float) -> float:
    if light.is_infinite:
        return math.inf
    farthest = np.max(np.abs(bounds - light.position), axis=0)
    geometry = float(np.linalg.norm(farthest)) * (1.0 + _MARGIN)
    return min(math.sqrt(_peak(light) * gain), geometry)


def _explain(plan: Plan) -> Iterator[Decision]:
    yield Decision("layout", plan.layout, "as asked")
    yield _explain_subdivision(plan)
    for plane in PLANES:
        yield _kept(f"plane {plane.name}", plane in plan.planes, "a material or layer needs it", "nothing needs it")
    for volume in ("quad", "sphere", "cone"):
        count = sum(planned.volume == volume for planned in plan.lights)
        yield Decision(f"{volume} volumes", f"{count} drawn" if count else "skipped", "lights that reach geometry")
    yield _kept("shadow maps", plan.shadows, "a light casts them", "no light casts any, or none were asked")
    yield _kept("environment", bool(plan.domes), "a dome lights the scene", "no dome")
    yield _kept("cutout", plan.cutout, "some opacity is or may be below 1", "no opacity is below 1")
    yield _kept("textures", plan.textures, "a material reads them", "no material reads any")
    if any(LAYERS[name].source != "lighting" for name in plan.layers):
        jittered, shared = "the beauty's is jittered, quantised or dithered", "the beauty's own float sample serves"
        yield _kept("data GBuffer", plan.data_pass or not plan.lit, jittered if plan.lit else "as asked", shared)
    if not plan.lit:
        yield Decision("lighting", "skipped", "no layer needs it")


def _explain_subdivision(plan: Plan) -> Decision:
    if not plan.levels:
        return Decision("subdivision", "skipped", "no subdivision surface")
    least, most = plan.levels[0], plan.levels[-1]
    levels = f"{least} levels" if least == most else f"{least} to {most} levels"
    reason = "by the surfaces' size in the image" if plan.complexity == "auto" else f"complexity {plan.complexity}"
    return Decision("subdivision", levels, reason)


def _kept(subject: str, kept: bool, why: str, why_not: str) -> Decision:
    return Decision(subject, "kept" if kept else "skipped", why if kept else why_not)
