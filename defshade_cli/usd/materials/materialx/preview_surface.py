"""UsdPreviewSurface as a MaterialX node: the same inputs, a mode that is a number, and normals already decoded."""

from __future__ import annotations

from defshade_cli.usd.materials.fields import FIELDS
from defshade_cli.usd.materials.materialx.surface import Model, Translation

_AS_THEY_ARE = (
    *("metallic", "roughness", "clearcoat", "clearcoatRoughness", "opacity", "opacityThreshold", "ior"),
    *("emissiveColor", "specularColor"),
)
"""Inputs that say what those of UsdPreviewSurface do."""


def _translate(to: Translation) -> None:
    to.put_base("diffuseColor", "")
    for name in _AS_THEY_ARE:
        to.put_plain(FIELDS[name], name)
    to.values["use_specular_workflow"] = bool(to["useSpecularWorkflow"].bias.any())
    to.values["opacity_mode"] = "presence" if to["opacityMode"].bias.any() else "transparent"
    to.put_normal("normal")
    to.put_occlusion()


PREVIEW_SURFACE = Model(
    defaults={
        "diffuseColor": (0.18, 0.18, 0.18),
        "emissiveColor": (0.0, 0.0, 0.0),
        "useSpecularWorkflow": 0.0,
        "specularColor": (0.0, 0.0, 0.0),
        "metallic": 0.0,
        "roughness": 0.5,
        "clearcoat": 0.0,
        "clearcoatRoughness": 0.01,
        "opacity": 1.0,
        "opacityMode": 0.0,
        "opacityThreshold": 0.0,
        "ior": 1.5,
        "normal": (0.0, 0.0, 1.0),
        "occlusion": 1.0,
    },
    left_out={"displacement": (0.0, "")},
    translate=_translate,
)
