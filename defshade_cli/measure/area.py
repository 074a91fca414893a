"""What a light of some size brings to surfaces, in float64, by summing over patches of its surface: no shadows.

Shapes are grids of points in light space, moved by the light's transform; a patch's area and normal are the cross
product of its diagonals. Nothing here knows how samples are drawn.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from defshade_cli.measure.brdf import Array, Surface, evaluate_brdf
from defshade_cli.measure.light import shaping_factor
from defshade_cli.scene.light import CylinderLight, DiskLight, DistantLight, Light, RectLight, SphereLight
from defshade_cli.settings import Shading
from defshade_cli.spaces import normalize, transform_points


def area_radiance(surface: Surface, light: Light, *, cells: int = 16, shading: Shading = "preview-surface") -> Array:
    """(P, 3) radiance towards the eye from a light without textures, its surface cut into cells x 4 cells patches."""
    total = np.zeros_like(surface.base)
    response = light.diffuse, light.specular
    for direction, irradiance in _patches(surface.position, light, cells):
        total += irradiance * evaluate_brdf(surface, direction, response, shading=shading)
    return total


def _patches(positions: Array, light: Light, cells: int) -> Iterator[tuple[Array, Array]]:
    """For each patch: (P, 3) unit directions to it and the irradiance (P, 3) facing it."""
    if isinstance(light, DistantLight):
        for direction, solid_angle in _sky_patches(light, cells):
            shape = positions.shape
            yield np.broadcast_to(direction, shape), np.broadcast_to(light.radiance * solid_angle, shape)
        return
    centres, areas = _surface_patches(light, cells)
    for centre, area in zip(centres, areas, strict=True):
        to_light = centre - positions
        squared = np.sum(to_light**2, axis=-1)
        direction = to_light / np.sqrt(squared)[:, None]
        irradiance = light.radiance * (np.maximum(-direction @ area, 0.0) / squared)[:, None]
        if light.shaping is not None:
            irradiance = irradiance * shaping_factor(light.shaping, light.axis, -direction)
        yield direction, irradiance


def _sky_patches(light: DistantLight, cells: int) -> Iterator[tuple[Array, float]]:
    half = math.radians(light.angle) / 2.0
    edges = np.cos(np.linspace(0.0, half, cells + 1))
    for low, high in zip(edges[1:], edges[:-1], strict=True):
        z = 0.5 * (low + high)
        for turn in 2.0 * math.pi * (np.arange(cells) + 0.5) / cells:
            ring = math.sqrt(1.0 - z * z)
            local = np.array([ring * math.cos(turn), ring * math.sin(turn), z])
            yield normalize(light.world_from_light[:3, :3] @ local), 2.0 * math.pi / cells * float(high - low)


def _surface_patches(light: Light, cells: int) -> tuple[Array, Array]:
    """(N, 3) centres in the world, and (N, 3) area vectors that point to where the light goes."""
    grid = transform_points(light.world_from_light, _grid(light, cells))
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    centres = (0.25 * (a + b + c + d)).reshape(-1, 3)
    areas = 0.5 * np.cross(c - a, d - b).reshape(-1, 3)
    outward = np.broadcast_to(light.axis, areas.shape) if light.profile == "cosine" else centres - light.position
    return centres, areas * np.sign(np.sum(areas * outward, axis=-1))[:, None]


def _grid(light: Light, cells: int) -> Array:
    """(cells + 1, 4 cells + 1, 3) points on the light's surface, in light space; circles are cut most finely."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, cells + 1), np.linspace(0.0, 1.0, 4 * cells + 1), indexing="ij")
    cosine, sine = np.cos(2.0 * math.pi * v), np.sin(2.0 * math.pi * v)
    match light:
        case RectLight(width=w, height=h):
            return np.stack([(u - 0.5) * w, (v - 0.5) * h, 0.0 * u], axis=-1)
        case DiskLight(radius=r):
            return r * np.stack([u * cosine, u * sine, 0.0 * u], axis=-1)
        case SphereLight(radius=r):
            z, ring = np.cos(math.pi * u), np.sin(math.pi * u)
            return r * np.stack([ring * cosine, ring * sine, z], axis=-1)
        case CylinderLight(radius=r, length=length):
            return np.stack([(u - 0.5) * length, r * cosine, r * sine], axis=-1)
    raise ValueError(f"no surface of a {light.kind} light")
