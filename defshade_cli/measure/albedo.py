"""How much light a GGX lobe takes for itself, and the bound on it that the shaders weigh the layer below with.

A lobe with Schlick's Fresnel term has the directional albedo E(μ, α) = F0 · W(μ, α) + (F90 − F0) · B(μ, α): W of a
white lobe, B of its edge weight (1 − VoH)⁵. `python -m defshade_cli.measure.albedo` integrates both and prints the
constants of `E_bound` in shaders/lib/brdf.glsl and defshade_cli/measure/brdf.py; docs/lighting.md tells what for.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import linprog

from defshade_cli.dataclass import dataclass
from defshade_cli.measure.brdf import Array, EdgeFit, V_SmithGGXCorrelated, V_SmithSchlick, edge_bound
from defshade_cli.measure.furnace import fibonacci_lattice, spherical
from defshade_cli.settings import SHADINGS, Shading

Visibility = Callable[[Array, Array, Array], Array]
"""(NoV, NoL, alpha) → G2 / (4 NoV NoL)."""

VISIBILITY: dict[Shading, Visibility] = {"preview-surface": V_SmithGGXCorrelated, "classic": V_SmithSchlick}

COSINES = np.concatenate([[1e-4, 1e-3, 3e-3, 0.01, 0.02, 0.03], np.linspace(0.05, 1.0, 39)])
ALPHAS = np.concatenate([[1e-4, 1e-3, 2.5e-3, 5e-3, 0.01, 0.02], np.linspace(0.04, 1.0, 25)])
TOLERANCE = 1e-4
"""What the fit may fall short by: the quadrature's error. B at normal incidence, where the fit is 0, is half of it."""
_GRAZING, _GRAZING_WEIGHT = 0.1, 0.25
"""Excess at cosines below, where a surface is a thin rim of its picture, counts a quarter."""
_STEPS, _DAMPED = 30, 15


@dataclass(frozen=True, slots=True, eq=False)
class AlbedoTable:
    """Of one visibility term. cosines: (M,); alphas: (A,); white, edge: (A, M), W and B."""

    cosines: Array
    alphas: Array
    white: Array
    edge: Array


def lobe_albedo(visibility: Visibility, cosine: float, alpha: float, *, points: int = 1 << 14) -> tuple[float, float]:
    """W and B, by `points` reflections at visible normals.

    Dupuy & Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps": what remains of the integrand is
    bounded, for lobes of any width.
    """
    view = np.array([np.sqrt(1.0 - cosine**2), 0.0, cosine])
    stretched = view * (alpha, alpha, 1.0)
    stretched /= np.linalg.norm(stretched)
    u, phi = fibonacci_lattice(points)
    half = (spherical((1.0 - u) * (1.0 + stretched[2]) - stretched[2], phi) + stretched) * (alpha, alpha, 1.0)
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    voh = half @ view
    nol = 2.0 * voh * half[:, 2] - cosine
    above = nol > 0.0
    masking = 2.0 / (cosine + np.sqrt(alpha**2 + (1.0 - alpha**2) * cosine**2))  # Smith's G1 / NoV
    weight = visibility(np.full(points, cosine), np.where(above, nol, 1.0), np.full(points, alpha)) * 4.0 * nol
    weight = np.where(above, weight / masking, 0.0)
    return float(weight.mean()), float((weight * (1.0 - voh) ** 5).mean())


def albedo_table(visibility: Visibility, cosines: Array = COSINES, alphas: Array = ALPHAS) -> AlbedoTable:
    """Albedos of the lobe by cosine (C,) and α (A,): integrals over the hemisphere, (A, C) each."""
    albedos = np.array([[lobe_albedo(visibility, mu, alpha) for mu in cosines] for alpha in alphas])
    return AlbedoTable(cosines, alphas, albedos[..., 0], albedos[..., 1])


def fit_edge(table: AlbedoTable) -> EdgeFit:
    """The `edge_bound` of least worst excess over B.

    The excess times the denominator is linear in the four constants: Dinkelbach's iteration of linear programs. What
    is bounded is the greatest B at this or any steeper cosine, so that a falling fit can lie close.
    """
    mu, alpha = np.meshgrid(table.cosines, table.alphas)
    edge = np.maximum.accumulate(table.edge[:, ::-1], axis=1)[:, ::-1]
    y = 1.0 - mu
    over = y**5 - edge
    terms = np.stack([over * mu, over * mu**2, -edge * alpha**2, y * alpha * mu], axis=-1).reshape(-1, 4)
    constant = (over * alpha).ravel()
    weight = np.where(mu < _GRAZING, _GRAZING_WEIGHT, 1.0).ravel()

    fit = np.array([0.2, 3.0, 15.0, 0.2])
    for step in range(_STEPS):
        denominator = (alpha + mu * (fit[0] + fit[1] * mu) + fit[2] * alpha**2).ravel()
        found = _least_excess(terms / denominator[:, None], constant / denominator, weight)
        fit = 0.5 * (fit + found) if step < _DAMPED else found
    return EdgeFit(*fit.tolist())


def _least_excess(terms: Array, constant: Array, weight: Array) -> Array:
    """(4,) x ≥ 0 with terms · x + constant ≥ −TOLERANCE everywhere and its weighted maximum least."""
    never_below = np.column_stack([-terms, np.zeros(len(terms))])
    at_most = np.column_stack([terms * weight[:, None], -np.ones(len(terms))])
    bounds = np.concatenate([constant + TOLERANCE, -constant * weight])
    return linprog([0, 0, 0, 0, 1], A_ub=np.concatenate([never_below, at_most]), b_ub=bounds).x[:4]


def excess(table: AlbedoTable, fit: EdgeFit) -> Array:
    """(A, M) how far the bound lies above B."""
    return edge_bound(table.cosines, table.alphas[:, None], fit) - table.edge


def main() -> None:
    """Print the fitted coefficients of every shading model, and how far off they are."""
    for shading in SHADINGS:
        table = albedo_table(VISIBILITY[shading])
        fit = fit_edge(table)
        over = excess(table, fit)
        print(f"{shading}: vec4({fit.a:.4g}, {fit.b:.4g}, {fit.c:.4g}, {fit.d:.4g})")
        print(f"  above B by {over[:, table.cosines >= _GRAZING].max():.4f} at most where μ ≥ {_GRAZING},", end=" ")
        print(f"{over.max():.4f} anywhere, {over.mean():.4f} on average; below it by {-over.min():.1e} at most")
        loss = (1.0 - table.white) / (table.cosines * table.alphas[:, None] ** 2)
        print(f"  W ≤ 1 − {loss[table.alphas >= 0.04].min():.4f} α² μ")


if __name__ == "__main__":
    main()
