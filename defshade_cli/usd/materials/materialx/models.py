"""The shading models that are understood, by the identifiers of their shaders."""

from __future__ import annotations

from dataclasses import replace

from pxr import UsdShade

from defshade_cli.usd.materials.materialx.gltf import GLTF_PBR
from defshade_cli.usd.materials.materialx.open_pbr import OPEN_PBR
from defshade_cli.usd.materials.materialx.preview_surface import PREVIEW_SURFACE
from defshade_cli.usd.materials.materialx.realitykit import REALITYKIT_PBR
from defshade_cli.usd.materials.materialx.standard_surface import STANDARD_SURFACE
from defshade_cli.usd.materials.materialx.surface import Model, Translation
from defshade_cli.usd.materials.materialx.unlit import UNLIT
from defshade_cli.usd.materials.network import Network

MODELS: dict[str, Model] = {
    "ND_UsdPreviewSurface_surfaceshader": PREVIEW_SURFACE,
    "ND_standard_surface_surfaceshader": STANDARD_SURFACE,
    "ND_standard_surface_surfaceshader_100": replace(
        STANDARD_SURFACE, defaults={**STANDARD_SURFACE.defaults, "base": 0.8, "base_color": (1.0, 1.0, 1.0)}
    ),
    "ND_open_pbr_surface_surfaceshader": OPEN_PBR,
    "ND_gltf_pbr_surfaceshader": GLTF_PBR,
    "ND_realitykit_pbr_surfaceshader": REALITYKIT_PBR,
    "ND_surface_unlit": UNLIT,
}


def translate(shader: UsdShade.Shader, identifier: str, network: Network, *, occlusion: bool) -> Translation:
    """The shader's inputs as fields of a Material.  occlusion: read it too."""
    return Translation(shader, network, MODELS[identifier], occlusion).run()
