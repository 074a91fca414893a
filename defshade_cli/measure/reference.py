"""A deferred shader in float64: from a float GBuffer and the scene's lights to each pixel's exact radiance.

It shares no code with the shaders, so that agreement means something.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.measure.brdf import Array, Surface, evaluate_brdf
from defshade_cli.measure.light import irradiance_at
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.light import Light
from defshade_cli.settings import Shading
from defshade_cli.spaces import normalize, transform_directions, transform_points
from defshade_cli.units import exposure_scale

DIELECTRIC_F0 = 0.04
"""Normal reflectance of a dielectric whose GBuffer has no specular plane: ior 1.5."""

Planes = Mapping[str, NDArray[np.float32]]


def reference_radiance(
    planes: Planes,
    camera: Camera,
    lights: Iterable[Light],
    *,
    shading: Shading = "preview-surface",
    exposure: float = 0.0,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The beauty that `planes` should give, (H, W, 3) float64, and the mask (H, W) of covered pixels.

    The background is 0. exposure: stops added to the camera's own.
    """
    surface, covered = surface_from_planes(planes, camera)
    radiance = np.zeros((*covered.shape, 3))
    sets = planes["links"][covered, 0].astype(int) if "links" in planes else np.zeros(len(surface.base), int)
    radiance[covered] = shade(surface, lights, sets, shading=shading) * (camera.exposure * exposure_scale(exposure))
    return radiance, covered


def shade(
    surface: Surface,
    lights: Iterable[Light],
    link_sets: NDArray[Any] | None = None,
    *,
    shading: Shading = "preview-surface",
) -> Array:
    """(P, 3) radiance towards the eye: emission plus every light's reflection, no shadows.

    link_sets: (P,) int, of what stands there; without them everything is linked.
    """
    radiance = surface.emission * surface.weights[:, 1:]
    for light in lights:
        direction, irradiance = irradiance_at(light, surface.position)
        reflected = irradiance * evaluate_brdf(surface, direction, (light.diffuse, light.specular), shading=shading)
        if light.links and link_sets is not None:
            reflected = reflected * light.links.lights[link_sets][:, None]
        radiance += reflected
    return radiance


def surface_from_planes(planes: Planes, camera: Camera) -> tuple[Surface, NDArray[np.bool_]]:
    """The covered pixels' Surface in row-major order, and their mask (H, W).

    planes: (H, W, C) float32, row 0 at the top. "base": rgb and metallic; "normal": world xyz and roughness;
        "depth": planar camera z, +inf on the background; "emission", "specular" (F0) and "clearcoat" (amount
        and roughness) and "weights" where the stage has them; "links": the link set.
    camera: conformed to the image's aspect.
    """
    depth = planes["depth"][..., 0].astype(np.float64)
    covered = np.isfinite(depth)

    def plane(name: str, channels: int) -> Array:
        values = planes.get(name, np.zeros((1, 1, channels)))
        return np.broadcast_to(values, (*depth.shape, values.shape[-1]))[covered].astype(np.float64)

    base, metallic = np.split(plane("base", 4), [3], axis=1)
    normal, roughness = np.split(plane("normal", 4), [3], axis=1)
    coat = plane("clearcoat", 2)
    edge = 1.0 - metallic + base * metallic
    metallic_f0 = edge * (DIELECTRIC_F0 * (1.0 - metallic) + metallic)
    position = _world_positions(depth, camera)[covered]
    surface = Surface(
        position=position,
        normal=normalize(normal),
        view=_directions_to_eye(position, camera),
        base=base,
        metallic=metallic[:, 0],
        roughness=roughness[:, 0],
        f0=plane("specular", 3)[:, :3] if "specular" in planes else metallic_f0,
        f90=edge,
        clearcoat=coat[:, 0],
        clearcoat_roughness=coat[:, 1],
        emission=plane("emission", 3)[:, :3],
        weights=plane("weights", 2)[:, :2] if "weights" in planes else np.ones((len(base), 2)),
    )
    return surface, covered


def _world_positions(depth: Array, camera: Camera) -> Array:
    """(H, W, 3) world points that the pixels' centres see; not finite on the background."""
    height, width = depth.shape
    left, right, bottom, top = camera.window
    x = left + (right - left) * (np.arange(width) + 0.5) / width
    y = top + (bottom - top) * (np.arange(height) + 0.5) / height
    window_x, window_y = np.meshgrid(x, y)
    spread = depth if camera.projection == "perspective" else np.ones_like(depth)
    with np.errstate(invalid="ignore"):
        points = np.stack([window_x * spread, window_y * spread, -depth], axis=-1)
        return transform_points(camera.world_from_camera, points)


def _directions_to_eye(positions: Array, camera: Camera) -> Array:
    if camera.projection == "orthographic":
        backward = transform_directions(camera.world_from_camera, np.array([0.0, 0.0, 1.0]))
        return np.broadcast_to(backward, positions.shape)
    return normalize(camera.position - positions)
