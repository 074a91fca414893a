"""How a frame is planned: what it needs, and what it skips, decided once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from defshade_cli.image.layers import BEAUTY, resolve
from defshade_cli.image.ocio import find_render_space
from defshade_cli.plan.bounds import SLACK
from defshade_cli.plan.changes import find_redrawing
from defshade_cli.plan.closed_casters import closed_casters
from defshade_cli.plan.coarse_casters import coarse_casters
from defshade_cli.plan.cost import choose_lighting
from defshade_cli.plan.lights import PlannedLight, plan_lights
from defshade_cli.plan.lobe_rays import roughest_rays, seen_by_rays
from defshade_cli.plan.moments import count_moments
from defshade_cli.plan.opacity import is_transparent, thin_materials, thin_numbers
from defshade_cli.plan.plan import Plan
from defshade_cli.plan.planes import divide_planes, is_lit
from defshade_cli.plan.points import cell_parts, rays_a_sample
from defshade_cli.plan.solidity import solid_materials
from defshade_cli.plan.texels import seen_texels
from defshade_cli.scene.camera import Camera, image_size
from defshade_cli.scene.geometry import box_corners
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.view import View
from defshade_cli.scene.window import DataWindow, from_ndc
from defshade_cli.settings import FILTERS, RenderSettings
from defshade_cli.spaces import transform_points
from defshade_cli.units import exposure_scale


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
    if is_lit(layers):
        lights = seen_by_rays(lights, scene, settings, thin=bool(thin))
    moments = count_moments(scene, settings)
    planes, data_planes, data_pass = divide_planes(scene, settings, layers, thin)
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
        moments=moments,
        filter=settings.filter,
        filter_width=settings.filter_width or FILTERS[settings.filter],
        layers=layers,
        planes=planes,
        data_planes=data_planes,
        lights=lights,
        lighting=choose_lighting(lights, camera, settings, layers, window.width * window.height, shadows=shadows),
        shadows=shadows,
        shadow_linked=shadows and scene.shadow_linked,
        lobe_rays=rays_a_sample(settings) if any(planned.by_rays for planned in lights) else 0,
        roughest_rays=roughest_rays(lights, scene),
        background=settings.background,
        thin=thin_ones,
        closed=closed_casters(scene, lights, settings.most_samples, thin_ones) if shadows else (),
        coarse=coarse_casters(scene, lights, settings.most_samples, moments, thin_ones) if shadows else (),
        solid=len(solid),
        transparent=is_transparent(thin, settings.shading),
        texels=seen_texels(scene, View(display_camera, display[1])),
        data_pass=data_pass,
        complexity=settings.complexity,
        ranks=settings.cryptomatte_levels,
        debug=settings.debug,
        portals=len(scene.portals),
        levels=tuple(sorted({mesh.level for mesh in scene.meshes if mesh.level is not None and mesh.level >= 0})),
        coarse_solids=sum(mesh.level is not None and mesh.level < 0 for mesh in scene.meshes),
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


def _seen_lights(lights: tuple[PlannedLight, ...], layers: tuple[str, ...]) -> tuple[PlannedLight, ...]:
    """All lights for a lit layer; for mere coverage the domes, which cover what is behind the geometry."""
    if is_lit(layers):
        return lights
    return tuple(planned for planned in lights if isinstance(planned.light, DomeLight))


def _tight_clip(camera: Camera, bounds: NDArray[np.float64]) -> tuple[float, float]:
    """The camera's clipping range without the empty space before and behind the geometry."""
    near, far = camera.clipping_range
    if not np.isfinite(bounds).all():
        return near, far
    depth = -transform_points(camera.camera_from_world, box_corners(bounds))[:, 2]
    slack = SLACK * float(np.abs(depth).max())
    tight = max(near, float(depth.min()) - slack), min(far, float(depth.max()) + slack)
    return tight if tight[0] < tight[1] else (near, far)
