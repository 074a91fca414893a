"""glTF 2.0's metallic-roughness material with its extensions: https://registry.khronos.org/glTF."""

from __future__ import annotations

from defshade_cli.usd.materials.materialx.surface import Model, Translation

_OPAQUE, _MASK = 0, 1


def _translate(to: Translation) -> None:
    to.put_base("base_color", "")
    to.put_plain("metallic", "metallic")
    to.put_plain("roughness", "roughness")
    to.put_specular("specular", "specular_color", "ior", "metallic")
    to.put_plain("clearcoat", "clearcoat")
    to.put_plain("clearcoat_roughness", "clearcoat_roughness")
    to.put_product("emissive_color", "emissive_strength", "emissive")
    to.put_normal("normal")
    to.put_occlusion()
    _cover(to)


def _cover(to: Translation) -> None:
    """alpha_mode: 0 ignores alpha, 1 cuts it at alpha_cutoff, 2 blends."""
    mode = int(to["alpha_mode"].bias[0])
    to.put_transparency(None if mode == _OPAQUE else "alpha", "transmission")
    if mode == _MASK:
        to.put("opacity_threshold", to["alpha_cutoff"], "alpha_cutoff")


GLTF_PBR = Model(
    defaults={
        "base_color": (1.0, 1.0, 1.0),
        "metallic": 1.0,
        "roughness": 1.0,
        "normal": (0.0, 0.0, 1.0),
        "occlusion": 1.0,
        "transmission": 0.0,
        "specular": 1.0,
        "specular_color": (1.0, 1.0, 1.0),
        "ior": 1.5,
        "alpha": 1.0,
        "alpha_mode": 0.0,
        "alpha_cutoff": 0.5,
        "clearcoat": 0.0,
        "clearcoat_roughness": 0.0,
        "emissive": (0.0, 0.0, 0.0),
        "emissive_strength": 1.0,
    },
    left_out={
        "iridescence": (0.0, ""),
        "sheen_color": (0.0, ""),
        "clearcoat_normal": (0.0, "clearcoat"),
        "thickness": (0.0, "transmission"),
        "anisotropy_strength": (0.0, ""),
        "dispersion": (0.0, "transmission"),
    },
    translate=_translate,
)
