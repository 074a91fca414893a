"""The white furnace: how much of a white environment a surface sends back, by quadrature in float64.

A model conserves energy where this directional albedo is at most 1 for every view direction.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from defshade_cli.measure.brdf import D_GGX, Array, Surface, alpha_from_roughness
from defshade_cli.spaces import normalize

Reflect = Callable[[Surface, NDArray[np.float64]], NDArray[np.float64]]
"""(surface of P points, light directions (P, 3)) → (P, 3) f · NoL."""


def directional_albedo(reflect: Reflect, material: Surface, cos_view: float, *, points: int = 1 << 15) -> Array:
    """(3,) ∫ f NoL dl over the hemisphere, the surface seen at `cos_view` from its normal.

    material: one point, whose lobes pick the quadrature. Sets of `points` directions, cosine-weighted ones and
    reflections at the half vectors of each lobe, are joined by the balance heuristic (Veach 1997, sec. 9.2.2), so
    that lobes of any width converge.
    """
    view = np.array([np.sqrt(1.0 - cos_view**2), 0.0, cos_view])
    alphas = [alpha_from_roughness(material.roughness)]
    if material.clearcoat.any():
        alphas.append(alpha_from_roughness(material.clearcoat_roughness))
    sets = [_cosine_directions(points), *(_lobe_directions(points, alpha, view) for alpha in alphas)]
    directions = np.concatenate(sets)
    directions = directions[directions[:, 2] > 0.0]

    half = normalize(view + directions)
    noh, voh = half[:, 2], half @ view
    density = directions[:, 2] / np.pi + sum(D_GGX(alpha, noh) * noh / (4.0 * voh) for alpha in alphas)
    reflected = reflect(seen_from(material, view, len(directions)), directions)
    return (reflected / density[:, None]).sum(axis=0) / points


def seen_from(material: Surface, view: Array, count: int) -> Surface:
    """`count` copies of a material of one point, lying in the xy plane and seen from `view` (3,)."""
    spread = {name: np.repeat(getattr(material, name), count, axis=0) for name in Surface.__slots__}
    spread["view"] = np.broadcast_to(view, (count, 3))
    return Surface(**spread)


def dielectric(base: float, roughness: float, f0: float = 0.04) -> Surface:
    """One point of a grey dielectric, normal +Z."""
    return _point(base, 0.0, roughness, f0, 1.0)


def metal(base: float, roughness: float) -> Surface:
    """One point of a grey metal, normal +Z."""
    return _point(base, 1.0, roughness, base, base)


def _point(base: float, metallic: float, roughness: float, f0: float, f90: float) -> Surface:
    def grey(value: float) -> Array:
        return np.full((1, 3), value)

    up, zero = np.array([[0.0, 0.0, 1.0]]), np.zeros(1)
    return Surface(
        position=np.zeros((1, 3)), normal=up, view=up, base=grey(base), metallic=np.full(1, metallic),
        roughness=np.full(1, roughness), f0=grey(f0), f90=grey(f90), clearcoat=zero,
        clearcoat_roughness=zero, emission=np.zeros((1, 3)), weights=np.ones((1, 2)),
    )  # fmt: skip


def fibonacci_lattice(points: int) -> tuple[Array, Array]:
    """u in (0, 1) and an angle in [0, 2π): evenly spread, and along no edge of what is integrated."""
    index = np.arange(points)
    turn = 2.0 / (1.0 + math.sqrt(5.0))
    return (index + 0.5) / points, 2.0 * np.pi * np.modf(index * turn)[0]


def spherical(cos_theta: Array, phi: Array) -> Array:
    """Unit vectors (..., 3) at angles around +z, in radians."""
    sin_theta = np.sqrt(np.maximum(1.0 - cos_theta**2, 0.0))
    return np.stack([sin_theta * np.cos(phi), sin_theta * np.sin(phi), cos_theta], axis=-1)


def _cosine_directions(points: int) -> Array:
    u, phi = fibonacci_lattice(points)
    return spherical(np.sqrt(u), phi)


def _lobe_directions(points: int, alpha: Array, view: Array) -> Array:
    """`view` mirrored at half vectors distributed as D · NoH (Walter et al. 2007, eq. 35)."""
    u, phi = fibonacci_lattice(points)
    half = spherical(1.0 / np.sqrt(1.0 + alpha**2 * u / (1.0 - u)), phi)
    return 2.0 * (half @ view)[:, None] * half - view
