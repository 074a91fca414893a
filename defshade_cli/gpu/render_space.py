"""The render space in GLSL."""

from __future__ import annotations

from itertools import chain

from defshade_cli.image.render_space import RenderSpace


def space_defines(space: RenderSpace) -> list[str]:
    """The define that lib/render_space.glsl converts by; none for linear Rec.709, in which scenes are."""
    if space.is_rec709:
        return []
    columns = zip(*space.from_rec709, strict=True)
    return [f"RENDER_FROM_REC709 mat3({', '.join(map(repr, chain(*columns)))})"]
