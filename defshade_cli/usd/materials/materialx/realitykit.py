"""RealityKit's physically based surface, of Reality Composer Pro: https://developer.apple.com/documentation/shadergraph."""

from __future__ import annotations

from defshade_cli.usd.materials.fields import FIELDS
from defshade_cli.usd.materials.materialx.surface import Model, Translation

_AS_THEY_ARE = (
    *("metallic", "roughness", "clearcoat", "clearcoatRoughness", "opacity", "opacityThreshold"),
    "emissiveColor",
)
"""Inputs that say what those of UsdPreviewSurface do."""


def _translate(to: Translation) -> None:
    to.put_base("baseColor", "")
    for name in _AS_THEY_ARE:
        to.put_plain(FIELDS[name], name)
    to.put_normal("normal")
    to.put_occlusion("ambientOcclusion")


REALITYKIT_PBR = Model(
    defaults={
        "baseColor": (1.0, 1.0, 1.0),
        "emissiveColor": (0.0, 0.0, 0.0),
        "metallic": 0.0,
        "roughness": 0.5,
        "clearcoat": 0.0,
        "clearcoatRoughness": 0.0,
        "opacity": 1.0,
        "opacityThreshold": 0.0,
        "normal": (0.0, 0.0, 1.0),
        "ambientOcclusion": 1.0,
    },
    left_out={
        "specular": (0.5, ""),
        "clearcoatNormal": ((0.0, 0.0, 1.0), "clearcoat"),
        "hasPremultipliedAlpha": (0.0, ""),
    },
    translate=_translate,
)
