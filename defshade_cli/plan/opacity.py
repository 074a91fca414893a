"""What of a scene lets through what lies behind it, and how."""

from __future__ import annotations

from collections.abc import Iterable

from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import Shading


def thin_materials(scene: Scene, solid: Iterable[Material]) -> tuple[Material, ...]:
    """Those whose opacity is or may be below 1. solid: see plan/solidity.py."""
    shown = [m.display_opacity for m in scene.meshes if m.display_opacity is not None]
    shown += [d.display_opacity for d in scene.drawables]
    shows_thin = any((opacity < 1.0).any() for opacity in shown)
    known = {id(material) for material in solid}
    others = (m for m in scene.materials if id(m) not in known)
    return tuple(m for m in others if _may_be_thin(m) or (m.uses_display_opacity and shows_thin))


def thin_numbers(scene: Scene, thin: Iterable[Material]) -> tuple[int, ...]:
    """Numbers of those materials, and of those that show one side alone where there are any thin ones."""
    found = {id(material) for material in thin}
    return tuple(i for i, m in enumerate(scene.materials) if found and (id(m) in found or m.one_sided))


def is_transparent(thin: Iterable[Material], shading: Shading) -> bool:
    """Do some keep their reflections whatever their opacity? The classic model knows one opacity for all."""
    return shading == "preview-surface" and any(m.is_transparent for m in thin)


def _may_be_thin(material: Material) -> bool:
    return material.opacity < 1.0 or "opacity" in material.inputs
