"""The parts of Mitsuba 3 that defshade's light transport needs and Mitsuba lacks. The only place that extends it.

Importing this needs mitsuba (the extra `reference`) and an LLVM of 17 or newer, which is searched by its names:
else it raises ImportError and DefshadeError.
"""

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi

from defshade_cli.measure.brdf import COAT_F0, MIN_ALPHA, MIN_NOV, SMITH_GGX, edge_bound
from defshade_cli.measure.llvm import find_llvm

find_llvm()
mi.set_variant("llvm_ad_rgb")


def _alpha(roughness: float) -> float:
    return min(max(roughness * roughness, MIN_ALPHA), 1.0)


def _lobe(alpha: float, nov: Any, nol: Any, h: Any) -> Any:
    """D · V of height-correlated GGX for a half vector in the shading frame; 1 − NoH² is |n × h|²."""
    a2 = alpha * alpha
    d = dr.square(alpha / (dr.square(h.x) + dr.square(h.y) + a2 * dr.square(h.z))) * dr.inv_pi
    v = nol * dr.sqrt(dr.square(nov) * (1 - a2) + a2) + nov * dr.sqrt(dr.square(nol) * (1 - a2) + a2)
    return d * 0.5 / v


def _schlick(f0: Any, f90: Any, cosine: Any) -> Any:
    return f0 + (f90 - f0) * dr.power(dr.clip(1 - cosine, 0, 1), 5)


def _taken(f0: Any, f90: Any, grazing: Any, alpha: Any) -> Any:
    """What a lobe may take from what lies below it: measure.brdf.E_bound, in Dr.Jit's terms."""
    white = 1 - math.log(2) * alpha * alpha * grazing
    return f0 * white + (f90 - f0) * edge_bound(grazing, alpha, SMITH_GGX)


class PreviewSurface(mi.BSDF):
    """UsdPreviewSurface by the formulas of docs/lighting.md, the same on both sides."""

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self._base, self._f0, self._f90 = (mi.Color3f(props[name]) for name in ("base", "f0", "f90"))
        self._metallic, self._clearcoat = props["metallic"], props["clearcoat"]
        self._alpha, self._coat_alpha = _alpha(props["roughness"]), _alpha(props["clearcoat_roughness"])
        self._opacity, self._is_transparent = props["opacity"], props["is_transparent"]
        both_sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [mi.BSDFFlags.GlossyReflection | both_sides, mi.BSDFFlags.Null | both_sides]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def _passed(self, cosine: Any) -> Any:
        """What goes straight through: all that the lobes leave, but for the opacity's share."""
        if self._opacity >= 1.0 or not self._is_transparent:
            return 1.0 - self._opacity
        nov = dr.maximum(dr.abs(cosine), MIN_NOV)
        lobe = dr.max(_taken(self._f0, self._f90, nov, self._alpha))
        coat = self._clearcoat * _taken(COAT_F0, 1.0, nov, self._coat_alpha)
        return (1.0 - self._opacity) * dr.clip(1 - lobe, 0, 1) * (1 - coat)

    def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
        return mi.Color3f(dr.select(active, self._passed(si.wi.z), 0.0))

    def _reflectance(self, nov: Any, nol: Any, voh: Any, h: Any) -> Any:
        """f(l, v): the one place that holds the model."""
        fresnel = _schlick(self._f0, self._f90, voh)
        grazing = dr.minimum(nov, nol)
        taken = dr.maximum(fresnel, _taken(self._f0, self._f90, grazing, self._alpha))
        diffuse = self._base * (self._opacity * (1 - self._metallic) * dr.inv_pi) * (1 - taken)
        coat = _schlick(COAT_F0, 1.0, voh)
        coat_taken = dr.maximum(coat, _taken(COAT_F0, 1.0, grazing, self._coat_alpha))
        kept = 1.0 if self._is_transparent else self._opacity
        below = diffuse + _lobe(self._alpha, nov, nol, h) * fresnel * kept
        above = _lobe(self._coat_alpha, nov, nol, h) * (coat * self._clearcoat * kept)
        return below * (1 - self._clearcoat * coat_taken) + above

    def _facing(self, si: Any, wo: Any) -> tuple[Any, Any]:
        """Both directions in a shading frame whose normal lies on the viewer's side of the geometry."""
        side = dr.sign(dr.dot(si.n, si.to_world(si.wi)))
        return si.wi * side, wo * side

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        wi, wo = self._facing(si, wo)
        h = dr.normalize(wi + wo)
        nol = wo.z
        value = self._reflectance(dr.maximum(wi.z, MIN_NOV), nol, dr.dot(wi, h), h) * nol
        return dr.select(active & (nol > 0), value, 0.0)

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        wi, wo = self._facing(si, wo)
        return dr.select(active & (wo.z > 0), self._density(wi, wo), 0.0)

    def _density(self, wi: Any, wo: Any) -> Any:
        """Half cosine-weighted, half the microfacets' normals."""
        h = dr.normalize(wi + wo)
        microfacets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self._alpha, False)
        specular = microfacets.pdf(wi, h) / (4 * dr.maximum(dr.dot(wi, h), 1e-6))
        return (1 - self._passed(wi.z)) * 0.5 * (mi.warp.square_to_cosine_hemisphere_pdf(wo) + specular)

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> tuple[Any, Any]:
        wi, _ = self._facing(si, si.wi)
        passed = self._passed(wi.z)
        passes = sample1 < passed
        sample1 = (sample1 - passed) / dr.maximum(1 - passed, 1e-6)
        microfacets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self._alpha, False)
        half, _ = microfacets.sample(wi, sample2)
        wo = dr.select(sample1 < 0.5, mi.warp.square_to_cosine_hemisphere(sample2), mi.reflect(wi, half))
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = self._facing(si, wo)[1]
        bs.pdf, bs.eta = dr.select(wo.z > 0, self._density(wi, wo), 0.0), 1.0
        bs.sampled_type, bs.sampled_component = mi.UInt32(+self.m_components[0]), mi.UInt32(0)
        weight = dr.select(bs.pdf > 0, self.eval(ctx, si, bs.wo, active) / bs.pdf, 0.0)
        bs.wo, bs.pdf = dr.select(passes, -si.wi, bs.wo), dr.select(passes, passed, bs.pdf)
        bs.sampled_type[passes], bs.sampled_component[passes] = +mi.BSDFFlags.Null, mi.UInt32(1)
        return bs, dr.select(active & (bs.pdf > 0), dr.select(passes, 1.0, weight), 0.0)

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self) -> str:
        """What Mitsuba prints."""
        return "PreviewSurface[]"


class ShapedArea(mi.Emitter):
    """Mitsuba's area emitter under UsdLuxShapingAPI: cone with softness, focus with tint. Angles in radians."""

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self._radiance, self._tint = mi.Color3f(props["radiance"]), mi.Color3f(props["focus_tint"])
        self._axis, self._focus = mi.Vector3f(props["axis"]), props["focus"]
        self._outer, self._inner = props["cone_angle"], props["cone_smooth_start"]
        self.m_flags = mi.EmitterFlags.Surface

    def _emitted(self, direction: Any) -> Any:
        """Radiance along unit vectors away from the light."""
        cosine = dr.dot(direction, self._axis)
        angle = dr.atan2(dr.norm(dr.cross(direction, self._axis)), cosine)
        t = dr.clip((angle - self._inner) / max(self._outer - self._inner, 1e-6), 0, 1)
        cone = 1 - t * t * (3 - 2 * t)
        return self._radiance * cone * dr.lerp(self._tint, 1.0, dr.power(dr.abs(cosine), self._focus))

    def eval(self, si: Any, active: Any = True) -> Any:
        return dr.select(active & (si.wi.z > 0), self._emitted(si.to_world(si.wi)), 0.0)

    def sample_direction(self, it: Any, sample: Any, active: Any = True) -> tuple[Any, Any]:
        ds = self.get_shape().sample_direction(it, sample, active)
        active &= (dr.dot(ds.d, ds.n) < 0) & (ds.pdf != 0)
        ds.emitter = mi.EmitterPtr(self)
        return ds, dr.select(active, self._emitted(-ds.d) / ds.pdf, 0.0)

    def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
        return dr.select(dr.dot(ds.d, ds.n) < 0, self.get_shape().pdf_direction(it, ds, active), 0.0)

    def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
        return dr.select(active & (dr.dot(ds.d, ds.n) < 0), self._emitted(-ds.d), 0.0)

    def to_string(self) -> str:
        """What Mitsuba prints."""
        return "ShapedArea[]"


mi.register_bsdf("preview_surface", PreviewSurface)
mi.register_emitter("shaped_area", ShapedArea)
