"""Surface materials in the terms of UsdPreviewSurface, to which every other model is mapped."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Color = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Material:
    """UsdPreviewSurface inputs with the schema's defaults; colours are scene-linear in the render space.

    uses_display_color: diffuse_color and opacity come from the drawable's displayColor and displayOpacity:
        the material of a prim that has none bound, or a displayColor reader.
    """

    path: str
    diffuse_color: Color = (0.18, 0.18, 0.18)
    emissive_color: Color = (0.0, 0.0, 0.0)
    use_specular_workflow: bool = False
    specular_color: Color = (0.0, 0.0, 0.0)
    metallic: float = 0.0
    roughness: float = 0.5
    clearcoat: float = 0.0
    clearcoat_roughness: float = 0.01
    opacity: float = 1.0
    opacity_threshold: float = 0.0
    opacity_mode: Literal["transparent", "presence"] = "transparent"
    ior: float = 1.5
    uses_display_color: bool = False


UNBOUND = Material("<unbound>", uses_display_color=True)
"""What a prim without a bound material is drawn with."""
