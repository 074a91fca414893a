"""The two reflection models in float64: what shaders/lib/brdf.glsl must agree with.

Written from the formulas of docs/lighting.md, not from the shader. Directions are unit vectors (..., 3) away
from the surface, cosines are (...,), colours are (..., 3); everything broadcasts.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.settings import Shading
from defshade_cli.spaces import normalize

Array = NDArray[np.float64]
Response = tuple[Array, Array]
"""(P, 1) each: multiplies the diffuse and the specular part."""

MIN_ALPHA = 1e-4
"""Least GGX alpha: roughness 0 is a delta that no point light can hit, so it means roughness 0.01."""
MIN_NOV = 1e-4
COAT_F0 = 0.04
"""Normal reflectance of the clearcoat: ior 1.5 whatever the base's ior is."""
CLASSIC_DIELECTRIC_F0 = 0.03


@dataclass(frozen=True, slots=True)
class EdgeFit:
    """The four constants of `edge_bound`."""

    a: float
    b: float
    c: float
    d: float


SMITH_GGX = EdgeFit(0.157, 3.167, 14.64, 0.2199)
"""Of V_SmithGGXCorrelated, as `python -m defshade_cli.measure.albedo` prints it."""
SMITH_SCHLICK = EdgeFit(0.0, 3.108, 22.64, 0.2103)
"""Of V_SmithSchlick."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """P shaded points, all arrays float64.

    position, normal, view: (P, 3) world space; normal unit and facing the camera, view unit towards the eye.
    base, f0, f90, emission: (P, 3) scene-linear; f0 and f90 are preview-surface's, classic derives its own.
    metallic, roughness, clearcoat, clearcoat_roughness: (P,) 0..1.
    weights: (P, 2) of the diffuse, and of lobes and emission: what a sample of a transparent surface stands for.
    """

    position: Array
    normal: Array
    view: Array
    base: Array
    metallic: Array
    roughness: Array
    f0: Array
    f90: Array
    clearcoat: Array
    clearcoat_roughness: Array
    emission: Array
    weights: Array


@dataclass(frozen=True, slots=True, eq=False)
class Angles:
    """(P,) cosines between the normal, view, light and half vector; nol is negative below the horizon."""

    nov: Array
    nol: Array
    noh: Array
    voh: Array

    @property
    def grazing(self) -> Array:
        """The lesser of NoV and NoL."""
        return np.minimum(self.nov, self.nol)

    @classmethod
    def between(cls, n: Array, v: Array, l: Array) -> Angles:  # noqa: E741
        """The cosines between unit vectors (..., 3): normal, towards the eye and towards the light."""
        h = normalize(v + l)
        return cls(np.maximum(_dot(n, v), MIN_NOV), _dot(n, l), _dot(n, h), _dot(v, h))


def alpha_from_roughness(roughness: Array) -> Array:
    """GGX alpha = roughness², as UsdPreviewSurface's schema suggests."""
    return np.clip(np.square(roughness), MIN_ALPHA, 1.0)


def D_GGX(alpha: Array, noh: Array) -> Array:
    """Walter et al. 2007, "Microfacet Models for Refraction", eq. 33; ∫ D NoH dh = 1."""
    a2 = np.square(alpha)
    return a2 / (np.pi * np.square(np.square(noh) * (a2 - 1.0) + 1.0))


def V_SmithGGXCorrelated(nov: Array, nol: Array, alpha: Array) -> Array:
    """Heitz 2014, "Understanding the Masking-Shadowing Function", eq. 99: G2 / (4 NoV NoL)."""
    a2 = np.square(alpha)
    lambda_v = nol * np.sqrt(np.square(nov) * (1.0 - a2) + a2)
    lambda_l = nov * np.sqrt(np.square(nol) * (1.0 - a2) + a2)
    return 0.5 / (lambda_v + lambda_l)


def G1_SchlickSmith(cosine: Array, k: Array) -> Array:
    """Schlick 1994, "An Inexpensive BRDF Model", eq. 19; k = alpha / 2 fits Smith's term for GGX."""
    return cosine / (cosine * (1.0 - k) + k)


def V_SmithSchlick(nov: Array, nol: Array, alpha: Array) -> Array:
    """Schlick's G1 on both sides, k = alpha / 2, over 4 NoV NoL."""
    k = alpha / 2.0
    return G1_SchlickSmith(nov, k) * G1_SchlickSmith(nol, k) / (4.0 * nov * nol)


def F_Schlick(f0: Array | float, f90: Array | float, voh: Array) -> Array:
    """Schlick 1994, eq. 15, with the edge colour `f90`; the cosine gains a trailing axis for colours."""
    return f0 + (f90 - f0) * np.power(1.0 - voh[..., None], 5)


def edge_bound(mu: Array, alpha: Array, fit: EdgeFit) -> Array:
    """At least the directional albedo of (1 − VoH)⁵ in a GGX lobe, falling in the cosine `mu`."""
    n = alpha + mu * (fit.a + fit.b * mu)
    return (1.0 - mu) * ((1.0 - mu) ** 4 * n + fit.d * alpha * mu) / (n + fit.c * alpha**2)


def E_bound(f0: Array | float, f90: Array | float, mu: Array, alpha: Array, fit: EdgeFit) -> Array:
    """At least the directional albedo of a lobe with F_Schlick; the cosine gains a trailing axis for colours.

    The white lobe's part, W ≤ 1 − ln 2 · α² μ, is exact at normal incidence on alpha 1.
    """
    white = 1.0 - math.log(2.0) * alpha**2 * mu
    return f0 * white[..., None] + (f90 - f0) * edge_bound(mu, alpha, fit)[..., None]


def evaluate_brdf(
    surface: Surface, light_direction: Array, response: tuple[float, float] = (1.0, 1.0), *, shading: Shading
) -> Array:
    """(P, 3) f · NoL, zero below the horizon; `response` multiplies the diffuse and the specular part."""
    angles = Angles.between(surface.normal, surface.view, light_direction)
    model = preview_surface if shading == "preview-surface" else classic
    lit = angles.nol > 0.0
    weighed = response[0] * surface.weights[:, :1], response[1] * surface.weights[:, 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        reflected = model(surface, angles, weighed) * angles.nol[..., None]
    return np.where(lit[..., None], reflected, 0.0)


def coverage(surface: Surface, opacity: Array | float, cosine: Array) -> Array:
    """(P,) how much of what lies behind a transparent surface it hides, along a direction off its normal.

    All that its lobes leave passes, but for the diffuse's share, the opacity.
    """
    fit, coat_alpha = SMITH_GGX, alpha_from_roughness(surface.clearcoat_roughness)
    lobe = E_bound(surface.f0, surface.f90, cosine, alpha_from_roughness(surface.roughness), fit).max(axis=-1)
    coat = surface.clearcoat * E_bound(COAT_F0, 1.0, cosine, coat_alpha, fit)[..., 0]
    return 1.0 - (1.0 - opacity) * np.clip(1.0 - lobe, 0.0, 1.0) * (1.0 - coat)


def preview_surface(surface: Surface, angles: Angles, response: Response) -> Array:
    """UsdPreviewSurface: Lambert under a GGX lobe, both under an optional white coat."""
    fresnel = F_Schlick(surface.f0, surface.f90, angles.voh)
    specular = _microfacets(surface.roughness, angles)[..., None] * fresnel
    taken = E_bound(surface.f0, surface.f90, angles.grazing, alpha_from_roughness(surface.roughness), SMITH_GGX)
    albedo = surface.base * (1.0 - surface.metallic[..., None])
    diffuse = albedo / np.pi * (1.0 - np.maximum(fresnel, taken))

    amount = surface.clearcoat[..., None]
    coat_fresnel = F_Schlick(COAT_F0, 1.0, angles.voh)
    coat = _microfacets(surface.clearcoat_roughness, angles)[..., None] * coat_fresnel * amount
    coat_taken = E_bound(COAT_F0, 1.0, angles.grazing, alpha_from_roughness(surface.clearcoat_roughness), SMITH_GGX)
    below = 1.0 - amount * np.maximum(coat_fresnel, coat_taken)
    return (diffuse * response[0] + specular * response[1]) * below + coat * response[1]


def classic(surface: Surface, angles: Angles, response: Response) -> Array:
    """The model this project started from, with its defects mended: see docs/lighting.md."""
    metallic = surface.metallic[..., None]
    real_albedo = surface.base - surface.base * metallic
    real_specular = (1.0 - metallic) * CLASSIC_DIELECTRIC_F0 + metallic * surface.base

    alpha = alpha_from_roughness(surface.roughness)
    lobe = D_GGX(alpha, angles.noh) * V_SmithSchlick(angles.nov, angles.nol, alpha)
    specular = lobe[..., None] * F_Schlick(real_specular, 1.0, angles.voh)
    taken = E_bound(real_specular, 1.0, angles.grazing, alpha, SMITH_SCHLICK)
    diffuse = real_albedo / np.pi * np.maximum(1.0 - np.maximum(specular, taken), 0.0)
    return diffuse * response[0] + specular * response[1]


def _microfacets(roughness: Array, angles: Angles) -> Array:
    alpha = alpha_from_roughness(roughness)
    return D_GGX(alpha, angles.noh) * V_SmithGGXCorrelated(angles.nov, angles.nol, alpha)


def _dot(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=-1)
