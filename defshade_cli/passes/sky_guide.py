"""Where in a sky the image looks for light.

All pixels share the directions of a sample, so they are drawn where pixels need them: half of them by the sky's
luminance alone, and half by what some thousand pixels see of it by their diffuse, and in lobes that have no rays of
their own (passes/lobe_rays.py), shadows apart. A smooth metal's pixels look into few directions, where luminance alone
would send hardly any. Whatever the density, the mean is the same.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.image.environment import sky_of
from defshade_cli.passes.readback import Planes, camera_positions
from defshade_cli.plan import Plan
from defshade_cli.scene.distribution import GridDistribution
from defshade_cli.scene.environment import LUMINANCE, Environment
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.window import DataWindow
from defshade_cli.spaces import normalize, rigid, transform_directions

Array = NDArray[np.float64]
SkyGuides = Mapping[DomeLight, GridDistribution]
NO_GUIDES: SkyGuides = {}

_ACROSS = 96
"""Pixels of the image in which the directions are looked for."""
_DIRECTIONS = 8
"""Of each lobe of a pixel."""
_PARTS, _PARTS_BESIDE_RAYS = (0.5, 0.35, 0.15), (0.5, 0.0, 0.5)
"""Of the directions, that are drawn by luminance, by lobes and by the diffuse; and where rays serve the lobes."""
_NORMALS = 6
"""Normals count as alike within about one over it, or cells times pixels would be many."""
_DIELECTRIC_F0 = 0.04


def scout(plan: Plan) -> Plan:
    """The whole image in few pixels: what a crop or a tile sees must not decide."""
    size = _ACROSS, max(round(_ACROSS * plan.display[1] / plan.display[0]), 1)
    return replace(plan, display=size, window=DataWindow(0, 0, *size), camera=plan.display_camera)


def sky_guides(planes: Planes, plan: Plan) -> SkyGuides:
    """Densities over the cells of each dome's sky; planes: of `scout(plan)`."""
    seen = _seen(planes, plan)
    if not len(seen.diffuse):
        return NO_GUIDES
    return {
        dome.light: _guide(dome.light, seen, _PARTS_BESIDE_RAYS if dome.by_rays else _PARTS)
        for dome in plan.domes
        if isinstance(dome.light, DomeLight)
    }


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """What P covered pixels look along, in world space, and reflect of it.

    normals: (P, 3).  diffuse: (P,) albedo.
    mirrored: (P, K, 3) directions drawn by the lobe.  specular: (P, K) what it reflects of each.
    """

    normals: Array
    diffuse: Array
    mirrored: Array
    specular: Array


def _guide(dome: DomeLight, seen: _Seen, parts: Sequence[float]) -> GridDistribution:
    """Each pixel counts by what it sees of a cell over all that it sees; the diffuse is known for each cell."""
    sky, local_from_world = sky_of(dome), rigid(dome.world_from_light).T
    cells = sky.cell_of(transform_directions(local_from_world, seen.mirrored.reshape(-1, 3)))
    mirrored = seen.specular * sky.luminance[cells].reshape(seen.specular.shape)
    normals, of_pixel = _alike(transform_directions(local_from_world, seen.normals))
    cosines = np.maximum(sky.directions.reshape(-1, 3) @ normals.T, 0.0)
    irradiance = sky.power.ravel() @ cosines
    total = mirrored.mean(axis=1) + seen.diffuse * irradiance[of_pixel] / math.pi
    total += 0.1 * total.mean() + 1e-300
    by_lobes = _counted(cells, mirrored / total[:, None], sky)
    by_diffuse = sky.power * (cosines @ np.bincount(of_pixel, seen.diffuse / total)).reshape(sky.power.shape)
    weighed = zip(parts, (sky.power, by_lobes, by_diffuse), strict=True)
    return GridDistribution(sum(part * weights / max(weights.sum(), 1e-300) for part, weights in weighed))


def _alike(normals: Array) -> tuple[Array, NDArray[np.intp]]:
    """Some (N, 3) means of those that lie together, and which of them stands for each of (P, 3)."""
    _, of = np.unique(np.round(normals * _NORMALS), axis=0, return_inverse=True)
    of = of.ravel()
    return normalize(np.column_stack([np.bincount(of, column) for column in normals.T])), of


def _counted(cells: tuple[NDArray[np.intp], NDArray[np.intp]], seen: Array, sky: Environment) -> Array:
    counts = np.zeros(sky.power.shape)
    np.add.at(counts, cells, seen.ravel())
    return _blurred(counts)


def _blurred(counts: Array) -> Array:
    """Over neighbouring cells; the first and the last column are neighbours."""
    across = (np.roll(counts, 1, axis=1) + counts + np.roll(counts, -1, axis=1)) / 3.0
    padded = np.pad(across, ((1, 1), (0, 0)), mode="edge")
    return (padded[:-2] + padded[1:-1] + padded[2:]) / 3.0


def _seen(planes: Planes, plan: Plan) -> _Seen:
    """Directions are drawn in the camera's space, so that they move as all does."""
    covered = np.isfinite(planes["depth"][..., 0])
    base, normal = (planes[name][covered].astype(np.float64) for name in ("base", "normal"))
    rays = camera_positions(planes["depth"], plan.camera)[covered]
    if plan.camera.projection == "orthographic":
        rays = np.broadcast_to([0.0, 0.0, -1.0], rays.shape)
    v, n = -normalize(rays), normalize(transform_directions(plan.camera.camera_from_world, normal[:, :3]))
    mirrored = _mirrored(v, n, normal[:, 3], np.random.default_rng(0).random((2, len(n), _DIRECTIONS)))
    metallic, luminance = base[:, 3], base[:, :3] @ LUMINANCE
    f0 = planes["specular"][covered][:, :3] @ LUMINANCE if "specular" in planes else np.full(len(n), _DIELECTRIC_F0)
    f0 = f0 + (luminance - f0) * metallic
    edge = (1.0 - np.clip((n * v).sum(axis=1), 0.0, 1.0)) ** 5
    specular = (f0 + (1.0 - f0) * edge)[:, None] * ((mirrored * n[:, None]).sum(axis=2) > 0.0)
    world_from_camera = plan.camera.world_from_camera
    mirrored, n = transform_directions(world_from_camera, mirrored), transform_directions(world_from_camera, n)
    return _Seen(n, luminance * (1.0 - metallic), mirrored, specular)


def _mirrored(v: Array, n: Array, roughness: Array, u: Array) -> Array:
    """(P, K, 3): `v` at half vectors drawn by GGX's D times the cosine."""
    alpha = np.maximum(roughness**2, 1e-4)[:, None]
    tangent = alpha * np.sqrt(u[0] / (1.0 - u[0]))
    h = _around(n, tangent, np.ones_like(tangent), u[1])
    return 2.0 * (h * v[:, None]).sum(axis=2, keepdims=True) * h - v[:, None]


def _around(n: Array, across: Array, along: Array, turn: Array) -> Array:
    """(P, K, 3) unit vectors `across` and `along` n, turned about it."""
    helper = np.where(np.abs(n[:, 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    x = normalize(np.cross(helper, n))
    y = np.cross(n, x)
    angle = math.tau * turn
    aside = np.cos(angle)[..., None] * x[:, None] + np.sin(angle)[..., None] * y[:, None]
    return normalize(across[..., None] * aside + along[..., None] * n[:, None])
