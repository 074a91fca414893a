"""Cards: up to six textured quads that stand for a model, on the faces of its box or crossed inside it.

Placement and texture coordinates are Hydra's (the stand-ins for draw modes in UsdImaging): a card without a texture of
its own shows the opposite one's, mirrored; where only some axes have textures, the others have no cards.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.scene.material import Color, Material
from defshade_cli.scene.scene import Unsupported
from defshade_cli.scene.texture import Texture, TextureInput
from defshade_cli.usd.material import ReadMaterial
from defshade_cli.usd.polygons import Polygons, Primvar
from defshade_cli.usd.texture import Unreadable, image_tiles

UNTEXTURED = "model:cardGeometry"
"""What names the material of cards where the model has no texture."""

_CARDS = ("XPos", "XNeg", "YPos", "YNeg", "ZPos", "ZNeg")
_UV = "cardsUv"
_CUT_OFF = 0.1
"""Opacity below which Hydra cuts cards out."""

_CORNERS = np.array([[1, 1], [0, 1], [0, 0], [1, 0]], np.float64)
"""Of every card, to the right and up as seen from outside, counter-clockwise."""


def read_cards(
    model: Usd.Prim, box: NDArray[np.float64], issues: list[str]
) -> tuple[Polygons, tuple[str, ...], NDArray[np.intp]]:
    """The cards for a model with bounds `box` (2, 3), the names of their materials, and which each card has (F,)."""
    geometry = UsdGeom.ModelAPI(model).GetModelCardGeometryAttr().Get()
    if geometry == UsdGeom.Tokens.fromTexture:
        issues.append("cardGeometry fromTexture: its cards are crossed inside the bounds")
    sources = _sources(model)
    drawn = [card for card in range(6) if sources[card] is not None]
    depth = 1.0 if geometry == UsdGeom.Tokens.box else 0.5
    units = np.array([_placed(card, depth) for card in drawn]).reshape(-1, 3)
    uvs = np.array([_mapped(card, sources[card] == _texture(card)) for card in drawn]).reshape(-1, 2)
    polygons = Polygons(
        points=(box[0] + units * (box[1] - box[0])).astype(np.float32),
        counts=np.full(len(drawn), 4),
        indices=np.arange(4 * len(drawn)),
        faces=np.arange(len(drawn), dtype=np.int32),
        uvs={_UV: Primvar(uvs.astype(np.float32), "vertex")},
    )
    names = tuple(dict.fromkeys(name for name in sources if name))
    return polygons, names, np.array([names.index(sources[card] or "") for card in drawn], np.intp)


def read_card_material(texture: Usd.Attribute, color: Color, shown_as: str) -> ReadMaterial:
    """What a card is drawn with; in the colour of the draw mode where its file cannot be found."""
    try:
        tiles = image_tiles(texture.Get(), texture)
    except Unreadable as reason:
        return ReadMaterial(Material(shown_as, color), issues=(Unsupported(shown_as, str(reason)),))
    image = Texture(tiles, wrap_s="clamp", wrap_t="clamp")
    inputs = {"diffuse_color": TextureInput(image, "rgb", uv=_UV), "opacity": TextureInput(image, "a", uv=_UV)}
    return ReadMaterial(Material(shown_as, color, opacity_threshold=_CUT_OFF, one_sided=True, inputs=inputs))


def _sources(model: Usd.Prim) -> list[str | None]:
    """Of each card the property that its material is from; None for one that is not drawn."""
    own = [bool(_asset_path(model, card)) for card in range(6)]
    hidden = _hidden_axis(model)
    sources: list[str | None] = []
    for card in range(6):
        shown = card if own[card] else card ^ 1
        name = UNTEXTURED if not any(own) else _texture(shown) if own[shown] else None
        sources.append(None if card // 2 == hidden else name)
    return sources


def _texture(card: int) -> str:
    return f"model:cardTexture{_CARDS[card]}"


def _asset_path(model: Usd.Prim, card: int) -> str:
    asset = model.GetAttribute(_texture(card)).Get()
    return asset.path if asset else ""


def _hidden_axis(model: Usd.Prim) -> int | None:
    """The stage's up axis where the nearest model:cardVisibility that is not inherited says `simple`."""
    prim = model
    while prim:
        visibility = UsdGeom.ModelAPI(prim).GetModelCardVisibilityAttr().Get()
        if visibility not in (None, UsdGeom.Tokens.inherited):
            up = str(UsdGeom.GetStageUpAxis(model.GetStage()))
            return "XYZ".index(up) if visibility == "simple" else None
        prim = prim.GetParent()
    return None


def _placed(card: int, depth: float) -> NDArray[np.float64]:
    """(4, 3) corners in the unit cube; `depth` along the axis that the card faces."""
    right, up = _CORNERS.T
    out = np.full(4, depth)
    axes = {
        "XPos": (out, right, up),
        "XNeg": (1 - out, 1 - right, up),
        "YPos": (1 - right, out, up),
        "YNeg": (right, 1 - out, up),
        "ZPos": (right, up, out),
        "ZNeg": (1 - right, up, 1 - out),
    }
    return np.stack(axes[_CARDS[card]], axis=1)


def _mapped(card: int, is_own: bool) -> NDArray[np.float64]:
    """(4, 2) texture coordinates; `is_own`: the texture is the card's and not the opposite one's."""
    s, t = _CORNERS.T
    match _CARDS[card]:
        case "ZPos":
            t = t if is_own else 1 - t
        case "ZNeg":
            s, t = 1 - s, 1 - t if is_own else t
        case _:
            s = s if is_own else 1 - s
    return np.stack([s, t], axis=1)
