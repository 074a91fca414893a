"""Autodesk Standard Surface: https://autodesk.github.io/standard-surface."""

from __future__ import annotations

from defshade_cli.usd.materials.materialx.signal import NonLinear, mixed
from defshade_cli.usd.materials.materialx.surface import Model, Translation


def _translate(to: Translation) -> None:
    to.put_base("base_color", "base")
    _scatter(to)
    to.put_plain("metallic", "metalness")
    to.put_plain("roughness", "specular_roughness")
    to.put_specular("specular", "specular_color", "specular_IOR", "metalness")
    to.put_plain("clearcoat", "coat")
    to.put_plain("clearcoat_roughness", "coat_roughness")
    to.put_product("emissive_color", "emission", "emission_color")
    to.put_transparency("opacity", "transmission")
    to.put_normal("normal")


def _scatter(to: Translation) -> None:
    """Light that scatters below the surface leaves as if from the surface, in the colour it has there."""
    amount = to["subsurface"]
    if amount.is_constant and not amount.bias.any():
        return
    to.lose("subsurface", "drawn as diffuse")
    try:
        color = mixed(to["base"] * to["base_color"], to["subsurface_color"], amount)
        to.put("diffuse_color", color, "subsurface_color")
    except NonLinear:
        if to.network.source(to.shader, "subsurface_color") != to.network.source(to.shader, "base_color"):
            to.lose("subsurface_color", "an image mixed with an image")


_COAT = "coat"
STANDARD_SURFACE = Model(
    defaults={
        "base": 1.0,
        "base_color": (0.8, 0.8, 0.8),
        "metalness": 0.0,
        "specular": 1.0,
        "specular_color": (1.0, 1.0, 1.0),
        "specular_roughness": 0.2,
        "specular_IOR": 1.5,
        "transmission": 0.0,
        "subsurface": 0.0,
        "subsurface_color": (1.0, 1.0, 1.0),
        "coat": 0.0,
        "coat_roughness": 0.1,
        "emission": 0.0,
        "emission_color": (1.0, 1.0, 1.0),
        "opacity": (1.0, 1.0, 1.0),
        "normal": (0.0, 0.0, 1.0),
    },
    left_out={
        "diffuse_roughness": (0.0, ""),
        "specular_anisotropy": (0.0, ""),
        "transmission_color": (1.0, "transmission"),
        "transmission_depth": (0.0, "transmission"),
        "sheen": (0.0, ""),
        "coat_color": (1.0, _COAT),
        "coat_anisotropy": (0.0, _COAT),
        "coat_IOR": (1.5, _COAT),
        "coat_normal": (0.0, _COAT),
        "coat_affect_color": (0.0, _COAT),
        "coat_affect_roughness": (0.0, _COAT),
        "thin_film_thickness": (0.0, ""),
    },
    translate=_translate,
)
