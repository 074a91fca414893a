"""Cards: up to six textured quads that stand for a model, on the faces of its box or crossed inside it.

Placement and texture coordinates are Hydra's (the stand-ins for draw modes in UsdImaging): a card without a texture of
its own shows the opposite one's, mirrored; where only some axes have textures, the others have no cards. Cards placed
by their textures lie where `worldtoscreen` in the headers of these says that they were seen.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.scene.material import Color, Material
from defshade_cli.scene.scene import Unsupported
from defshade_cli.scene.texture import SeenFrom, Texture, TextureInput
from defshade_cli.usd.materials.material import ReadMaterial
from defshade_cli.usd.materials.texture import Unreadable, image_tiles
from defshade_cli.usd.polygons.polygons import Polygons, Primvar

UNTEXTURED = "model:cardGeometry"
"""What names the material of cards where the model has no texture."""

_CARDS = ("XPos", "XNeg", "YPos", "YNeg", "ZPos", "ZNeg")
_UV = "cardsUv"
_CUT_OFF = 0.1
"""Opacity below which Hydra cuts cards out."""

_CORNERS = np.array([[1, 1], [0, 1], [0, 0], [1, 0]], np.float64)
"""Of every card, to the right and up as seen from outside, counter-clockwise."""

_SCREEN = np.array([[-1, -1, 0, 1], [-1, 1, 0, 1], [1, 1, 0, 1], [1, -1, 0, 1]], np.float64)
_SCREEN_UVS = np.array([[0, 1], [0, 0], [1, 0], [1, 1]], np.float32)
"""Corners of a card placed by its texture, as rows in clip space, whose y points down."""


def read_cards(
    model: Usd.Prim, box: NDArray[np.float64], issues: list[str], seen_from: SeenFrom | None
) -> tuple[Polygons, tuple[str, ...], NDArray[np.intp]]:
    """The cards for a model with bounds `box` (2, 3), the names of their materials, and which each card has (F,)."""
    geometry = UsdGeom.ModelAPI(model).GetModelCardGeometryAttr().Get()
    if geometry == UsdGeom.Tokens.fromTexture:
        return _read_seen_cards(model, issues, seen_from)
    sources = _sources(model)
    drawn = [card for card in range(6) if sources[card] is not None]
    depth = 1.0 if geometry == UsdGeom.Tokens.box else 0.5
    units = np.array([_placed(card, depth) for card in drawn]).reshape(-1, 3)
    uvs = np.array([_mapped(card, sources[card] == _texture(card)) for card in drawn]).reshape(-1, 2)
    polygons = _quads(box[0] + units * (box[1] - box[0]), uvs)
    names = tuple(dict.fromkeys(name for name in sources if name))
    return polygons, names, np.array([names.index(sources[card] or "") for card in drawn], np.intp)


def _read_seen_cards(
    model: Usd.Prim, issues: list[str], seen_from: SeenFrom | None
) -> tuple[Polygons, tuple[str, ...], NDArray[np.intp]]:
    """A card for each texture that says where it was seen from; the others are reported."""
    placed: dict[str, NDArray[np.float64]] = {}
    for name in (_texture(card) for card in range(6) if _asset_path(model, card)):
        try:
            placed[name] = _seen_corners(model.GetAttribute(name), seen_from)
        except Unreadable as reason:
            issues.append(f"{name} has no card: {reason}")
    points = np.array(list(placed.values())).reshape(-1, 3)
    return _quads(points, np.tile(_SCREEN_UVS, (len(placed), 1))), tuple(placed), np.arange(len(placed))


def _seen_corners(texture: Usd.Attribute, seen_from: SeenFrom | None) -> NDArray[np.float64]:
    """(4, 3) in the model's space. Raises Unreadable."""
    (_, file), *_ = image_tiles(texture.Get(), texture)
    try:
        screen_from_model = seen_from(file) if seen_from else None
        if screen_from_model is None:
            raise Unreadable("its header has no worldtoscreen")
        corners = _SCREEN @ np.linalg.inv(screen_from_model)
    except OSError as error:
        raise Unreadable(str(error)) from error
    except np.linalg.LinAlgError as error:
        raise Unreadable("its worldtoscreen cannot be inverted") from error
    if not np.isfinite(corners).all() or not corners[:, 3].all():
        raise Unreadable("its worldtoscreen places it at infinity")
    return corners[:, :3] / corners[:, 3:]


def _quads(points: NDArray[np.float64], uvs: NDArray[np.floating]) -> Polygons:
    """Of corners (4 Q, 3), with their texture coordinates (4 Q, 2)."""
    count = len(points) // 4
    return Polygons(
        points=points.astype(np.float32),
        counts=np.full(count, 4),
        indices=np.arange(4 * count),
        faces=np.arange(count, dtype=np.int32),
        uvs={_UV: Primvar(uvs.astype(np.float32), "vertex")},
    )


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
