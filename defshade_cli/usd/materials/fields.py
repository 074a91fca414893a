"""UsdPreviewSurface in the terms of scene.material.Material."""

from __future__ import annotations

FIELDS = {
    "diffuseColor": "diffuse_color",
    "emissiveColor": "emissive_color",
    "useSpecularWorkflow": "use_specular_workflow",
    "specularColor": "specular_color",
    "metallic": "metallic",
    "roughness": "roughness",
    "clearcoat": "clearcoat",
    "clearcoatRoughness": "clearcoat_roughness",
    "opacity": "opacity",
    "opacityThreshold": "opacity_threshold",
    "opacityMode": "opacity_mode",
    "ior": "ior",
    "occlusion": "occlusion",
    "normal": "normal",
}
"""UsdPreviewSurface inputs and the fields they fill; a normal only from a texture."""
