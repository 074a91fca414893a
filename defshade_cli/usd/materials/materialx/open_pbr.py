"""OpenPBR Surface: https://academysoftwarefoundation.github.io/OpenPBR."""

from __future__ import annotations

from defshade_cli.usd.materials.materialx.surface import Model, Translation


def _translate(to: Translation) -> None:
    to.put_base("base_color", "base_weight")
    to.put_plain("metallic", "base_metalness")
    to.put_plain("roughness", "specular_roughness")
    to.put_specular("specular_weight", "specular_color", "specular_ior", "base_metalness")
    to.put_plain("clearcoat", "coat_weight")
    to.put_plain("clearcoat_roughness", "coat_roughness")
    to.put_product("emissive_color", "emission_luminance", "emission_color")
    to.put_transparency("geometry_opacity", "transmission_weight")
    to.put_normal("geometry_normal")


_COAT = "coat_weight"
OPEN_PBR = Model(
    defaults={
        "base_weight": 1.0,
        "base_color": (0.8, 0.8, 0.8),
        "base_metalness": 0.0,
        "specular_weight": 1.0,
        "specular_color": (1.0, 1.0, 1.0),
        "specular_roughness": 0.3,
        "specular_ior": 1.5,
        "transmission_weight": 0.0,
        "coat_weight": 0.0,
        "coat_roughness": 0.0,
        "coat_ior": 1.6,
        "coat_darkening": 1.0,
        "emission_luminance": 0.0,
        "emission_color": (1.0, 1.0, 1.0),
        "geometry_opacity": 1.0,
        "geometry_normal": (0.0, 0.0, 1.0),
    },
    left_out={
        "base_diffuse_roughness": (0.0, ""),
        "specular_roughness_anisotropy": (0.0, ""),
        "transmission_color": (1.0, "transmission_weight"),
        "transmission_depth": (0.0, "transmission_weight"),
        "subsurface_weight": (0.0, ""),
        "fuzz_weight": (0.0, ""),
        "coat_color": (1.0, _COAT),
        "coat_roughness_anisotropy": (0.0, _COAT),
        "coat_ior": (1.5, _COAT),
        "coat_darkening": (0.0, _COAT),
        "geometry_coat_normal": (0.0, _COAT),
        "thin_film_weight": (0.0, ""),
    },
    translate=_translate,
)
