"""Draw modes: models that are replaced by a box, by their axes or by textured cards, as UsdGeomModelAPI says.

model:drawMode       inherited down the model hierarchy
model:applyDrawMode  where it takes effect: on components, unless they say no, and on other models that say yes
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pxr import Kind, Sdf, Usd, UsdGeom

from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Unsupported
from defshade_cli.scene.texture import SeenFrom
from defshade_cli.usd.gprims.copies import bars
from defshade_cli.usd.materials.material import ReadMaterial
from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.polygons.subsets import Faces
from defshade_cli.usd.surfaces.geometry import Surface

FULL = "default"
"""The mode that draws the model itself."""

_COLOR = UsdGeom.Tokens.modelDrawModeColor
_NO_COLOR = (0.18, 0.18, 0.18)
"""The schema's, for models to which it is not applied."""

_LINE_WIDTH = 0.008
"""Of the diagonal of what is drawn in lines, which are no thinner than a pixel, and in a viewer no wider."""

_BOX_FACES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
_BITS = np.array([[corner >> 2 & 1, corner >> 1 & 1, corner & 1] for corner in range(8)])
_EDGES = np.array([[low, low | bit] for bit in (1, 2, 4) for low in range(8) if not low & bit])
_AXES = np.array([[0, 4], [0, 2], [0, 1]])


def handed_down(prim: Usd.Prim, above: str) -> str | None:
    """The draw mode of `prim`, whose parent hands down `above`; None where it is no model."""
    return str(UsdGeom.ModelAPI(prim).ComputeModelDrawMode(above)) if prim.IsModel() else None


def mode_above(prim: Usd.Prim) -> str:
    """What the parents of `prim` hand down."""
    return str(UsdGeom.ModelAPI(prim.GetParent()).ComputeModelDrawMode())


def takes_effect(prim: Usd.Prim) -> bool:
    """Is `prim` a model that its draw mode replaces?"""
    if not prim.IsModel():
        return False
    authored = UsdGeom.ModelAPI(prim).GetModelApplyDrawModeAttr()
    if authored.HasAuthoredValue():
        return bool(authored.Get())
    return Kind.Registry.IsA(Usd.ModelAPI(prim).GetKind(), Kind.Tokens.component)


class StandIns:
    """What is drawn in place of models; the boxes of their geometry are kept."""

    def __init__(self, seen_from: SeenFrom | None = None) -> None:
        self._seen_from = seen_from
        purposes = [UsdGeom.Tokens.default_, UsdGeom.Tokens.proxy, UsdGeom.Tokens.render]
        self._boxes = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), purposes, useExtentsHint=True)

    def read(self, prim: Usd.Prim, mode: str) -> Surface:
        """The stand-in in the model's space. Its groups are bound to properties of the prim, see read_material."""
        path, issues = str(prim.GetPath()), list[str]()
        if mode == UsdGeom.Tokens.origin:
            return _lines(path, np.array([[0.0] * 3, [1.0] * 3]), _AXES)
        box = self._box(prim)
        if box is None:
            return _surface(path, (), _bar(), None, ["it has no bounds to draw"])
        if mode != UsdGeom.Tokens.cards:
            return _lines(path, box, _EDGES)
        from defshade_cli.usd.models.cards import read_cards

        polygons, names, group = read_cards(prim, box, issues, self._seen_from)
        return _surface(path, names, polygons, group, issues)

    def _box(self, prim: Usd.Prim) -> NDArray[np.float64] | None:
        found = self._boxes.ComputeUntransformedBound(prim).ComputeAlignedRange()
        return None if found.IsEmpty() else np.array([found.GetMin(), found.GetMax()])


def read_material(stage: Usd.Stage, path: Sdf.Path, shown_as: str) -> ReadMaterial:
    """The material of a stand-in, which is named by the property that it is from.

    A card's by its texture; lines and cards without texture have the draw mode's colour, and lines shine by themselves.
    """
    from defshade_cli.usd.models.cards import UNTEXTURED, read_card_material

    prim = stage.GetPrimAtPath(path.GetPrimPath())
    r, g, b = UsdGeom.ModelAPI(prim).GetModelDrawModeColorAttr().Get() or _NO_COLOR
    color = (float(r), float(g), float(b))
    if path.name == UNTEXTURED:
        return ReadMaterial(Material(shown_as, color))
    if path.name != _COLOR:
        return read_card_material(prim.GetAttribute(path.name), color, shown_as)
    black = (0.0, 0.0, 0.0)
    return ReadMaterial(Material(shown_as, black, color, use_specular_workflow=True, specular_color=black))


def _surface(
    path: str, names: tuple[str, ...], polygons: Polygons, group: NDArray[np.intp] | None, issues: list[str]
) -> Surface:
    groups = tuple(f"{path}.{name}" for name in names)
    faces = Faces(groups or (path,), group)
    reported = tuple(Unsupported(path, issue) for issue in issues)
    return Surface(path, polygons, None, faces, groups, False, None, None, None, reported)


def _lines(path: str, box: NDArray[np.float64], edges: NDArray[np.intp]) -> Surface:
    """Edges (E, 2) between corners of a box, each along an axis; corners are numbered by the bits of x, y and z."""
    start, end = (np.where(_BITS[edges[:, side]], box[1], box[0]) for side in (0, 1))
    width = _LINE_WIDTH * float(np.linalg.norm(box[1] - box[0]))
    axis = np.abs(_BITS[edges[:, 1]] - _BITS[edges[:, 0]]).argmax(axis=1)
    directions = np.eye(3)[(axis[:, None] + np.arange(3)) % 3]
    sizes = np.full((len(edges), 3), width)
    sizes[:, 0] += np.abs(end - start).sum(axis=1)
    object_from_bar = np.tile(np.eye(4), (len(edges), 1, 1))
    object_from_bar[:, :3, :3] = (directions * sizes[..., None]).transpose(0, 2, 1)
    object_from_bar[:, :3, 3] = start - 0.5 * width * directions[:, 0]
    return replace(_surface(path, (_COLOR,), _bar(), None, []), copies=bars(object_from_bar))


def _bar() -> Polygons:
    """Along x from 0 to 1, and 1 wide."""
    return Polygons(
        points=(_BITS - (0.0, 0.5, 0.5)).astype(np.float32),
        counts=np.full(len(_BOX_FACES), 4),
        indices=_BOX_FACES.ravel(),
        faces=np.arange(len(_BOX_FACES), dtype=np.int32),
    )
