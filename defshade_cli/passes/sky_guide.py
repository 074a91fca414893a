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
_IS_MIRROR = np.arange(2 * _DIRECTIONS) < _DIRECTIONS
_DIELECTRIC_F0 = 0.04


def scout(plan: Plan) -> Plan:
    """The whole image in few pixels: what a crop or a tile sees must not decide."""
    size = _ACROSS, max(round(_ACROSS * plan.display[1] / plan.display[0]), 1)
    return replace(plan, display=size, window=DataWindow(0, 0, *size), camera=plan.display_camera)


def sky_guides(planes: Planes, plan: Plan) -> SkyGuides:
    """Densities over the cells of each dome's sky; planes: of `scout(plan)`."""
    directions, shares = _looked_along(planes, plan)
    if not len(shares):
        return NO_GUIDES
    return {
        dome.light: _guide(dome.light, directions, shares, _PARTS_BESIDE_RAYS if dome.by_rays else _PARTS)
        for dome in plan.domes
        if isinstance(dome.light, DomeLight)
    }


def _guide(dome: DomeLight, directions: Array, shares: Array, parts: Sequence[float]) -> GridDistribution:
    sky = sky_of(dome)
    local = transform_directions(rigid(dome.world_from_light).T, directions.reshape(-1, 3))
    cells = sky.cell_of(local)
    seen = shares * sky.luminance[cells].reshape(shares.shape)
    total = seen.sum(axis=1, keepdims=True)
    seen /= total + 0.1 * total.mean() + 1e-300
    mirrored, scattered = (_counted(cells, seen * lobe, sky) for lobe in (_IS_MIRROR, ~_IS_MIRROR))
    weighed = zip(parts, (sky.power, mirrored, scattered), strict=True)
    return GridDistribution(sum(part * weights / max(weights.sum(), 1e-300) for part, weights in weighed))


def _counted(cells: tuple[NDArray[np.intp], NDArray[np.intp]], seen: Array, sky: Environment) -> Array:
    counts = np.zeros(sky.power.shape)
    np.add.at(counts, cells, seen.ravel())
    return _blurred(counts)


def _blurred(counts: Array) -> Array:
    """Over neighbouring cells; the first and the last column are neighbours."""
    across = (np.roll(counts, 1, axis=1) + counts + np.roll(counts, -1, axis=1)) / 3.0
    padded = np.pad(across, ((1, 1), (0, 0)), mode="edge")
    return (padded[:-2] + padded[1:-1] + padded[2:]) / 3.0


def _looked_along(planes: Planes, plan: Plan) -> tuple[Array, Array]:
    """(P, 2K, 3) directions in world space that the covered pixels' lobes sample, and the (P, 2K) share of each.

    They are drawn in the camera's space, so that they move as all does.
    """
    covered = np.isfinite(planes["depth"][..., 0])
    base, normal = (planes[name][covered].astype(np.float64) for name in ("base", "normal"))
    rays = camera_positions(planes["depth"], plan.camera)[covered]
    if plan.camera.projection == "orthographic":
        rays = np.broadcast_to([0.0, 0.0, -1.0], rays.shape)
    v, n = -normalize(rays), normalize(transform_directions(plan.camera.camera_from_world, normal[:, :3]))
    u = np.random.default_rng(0).random((2, len(n), _DIRECTIONS))
    mirrored = _mirrored(v, n, normal[:, 3], u)
    scattered = _scattered(n, u)
    metallic, luminance = base[:, 3], base[:, :3] @ LUMINANCE
    f0 = planes["specular"][covered][:, :3] @ LUMINANCE if "specular" in planes else np.full(len(n), _DIELECTRIC_F0)
    f0 = f0 + (luminance - f0) * metallic
    edge = (1.0 - np.clip((n * v).sum(axis=1), 0.0, 1.0)) ** 5
    shares = np.stack([f0 + (1.0 - f0) * edge, luminance * (1.0 - metallic)], axis=1).repeat(_DIRECTIONS, axis=1)
    directions = np.concatenate([mirrored, scattered], axis=1)
    shares = shares * ((directions * n[:, None]).sum(axis=2) > 0.0)
    return transform_directions(plan.camera.world_from_camera, directions), shares


def _mirrored(v: Array, n: Array, roughness: Array, u: Array) -> Array:
    """(P, K, 3): `v` at half vectors drawn by GGX's D times the cosine."""
    alpha = np.maximum(roughness**2, 1e-4)[:, None]
    tangent = alpha * np.sqrt(u[0] / (1.0 - u[0]))
    h = _around(n, tangent, np.ones_like(tangent), u[1])
    return 2.0 * (h * v[:, None]).sum(axis=2, keepdims=True) * h - v[:, None]


def _scattered(n: Array, u: Array) -> Array:
    """(P, K, 3): by the cosine."""
    return _around(n, np.sqrt(u[0]), np.sqrt(1.0 - u[0]), u[1])


def _around(n: Array, across: Array, along: Array, turn: Array) -> Array:
    """(P, K, 3) unit vectors `across` and `along` n, turned about it."""
    helper = np.where(np.abs(n[:, 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    x = normalize(np.cross(helper, n))
    y = np.cross(n, x)
    angle = math.tau * turn
    aside = np.cos(angle)[..., None] * x[:, None] + np.sin(angle)[..., None] * y[:, None]
    return normalize(across[..., None] * aside + along[..., None] * n[:, None])
