"""Surface materials in the terms of UsdPreviewSurface, to which every other model is mapped."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Literal

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.texture import TextureInput

Color = tuple[float, float, float]

UV_SETS = 8
"""Sets of texture coordinates that the materials of a mesh can read."""

TEXTURED_FIELDS = (
    "diffuse_color",
    "emissive_color",
    "specular_color",
    "metallic",
    "roughness",
    "clearcoat",
    "clearcoat_roughness",
    "opacity",
    "ior",
    "occlusion",
    "normal",
)
"""What a texture may feed: fields of Material, and the normal in tangent space, which has no constant."""


@dataclass(frozen=True, slots=True)
class Material:
    """UsdPreviewSurface inputs with the schema's defaults; colours are scene-linear in the render space.

    uses_display_color: diffuse_color comes from the drawable's display_color, and only stands in where it has none.
    uses_display_opacity: opacity likewise. A prim without a bound material has both, a material that reads
        the primvars either.
    color_primvar: what is read in the place of displayColor; empty for displayColor itself.
    primvars: what each prim that the material is on has for its fields, by their names; none in a Scene.
    one_sided: not seen from behind; only for materials whose opacity is textured, as the cards of draw modes are.
    inputs: the textures, by the name of the field in TEXTURED_FIELDS that they replace.
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
    occlusion: float = 1.0
    uses_display_color: bool = False
    uses_display_opacity: bool = False
    color_primvar: str = ""
    one_sided: bool = False
    primvars: Mapping[str, str] = field(default_factory=dict, hash=False)
    inputs: Mapping[str, TextureInput] = field(default_factory=dict, hash=False)

    @property
    def is_transparent(self) -> bool:
        """Does opacity scale the diffuse alone? A threshold takes the place of either mode."""
        return self.opacity_mode == "transparent" and self.opacity_threshold == 0.0

    @property
    def uv_names(self) -> tuple[str, ...]:
        """The primvars that its textures read, each once."""
        return tuple(dict.fromkeys(i.uv for i in self.inputs.values() if i.uv))


UNBOUND = Material("<unbound>", opacity_mode="presence", uses_display_color=True, uses_display_opacity=True)
"""What a prim without a bound material is drawn with."""
