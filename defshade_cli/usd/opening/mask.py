"""A stage limited to some prims: the others are not even composed.

Populated are the masked prims, all that stands above and below them, and what these refer to: materials with their
networks, prototypes of PointInstancers, skeletons and blend shapes. The camera that the user names by its path is
there too. Lights are prims like others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pxr import Sdf, Usd, UsdRender, UsdShade

from defshade_cli.errors import PrimNotFound

_RELATIONS = ("prototypes", "skel:", "material:binding", "camera", "products", "orderedVars")
"""Relationships, by the start of their names, whose targets it takes to draw a prim. Those of light linking do not
count: they name what is lit, not what is needed."""


def limited_to(paths: Sequence[str], camera: str | None) -> Usd.StagePopulationMask:
    """Raises PrimNotFound for what is no absolute prim path."""
    mask = Usd.StagePopulationMask()
    for path in paths:
        if not (Sdf.Path.IsValidPathString(path) and Sdf.Path(path).IsAbsoluteRootOrPrimPath()):
            raise PrimNotFound(f"{path} in the mask is no path of a prim, such as /World/Chair")
        mask.Add(path)
    if camera and camera.startswith("/") and Sdf.Path.IsValidPathString(camera):
        mask.Add(Sdf.Path(camera).GetPrimPath())
    return mask


def add_what_is_referred_to(stage: Usd.Stage, paths: Sequence[str]) -> None:
    """Populate the targets of what is populated, and theirs. Raises PrimNotFound for one of `paths` without prim."""
    for path in paths:
        if not stage.GetPrimAtPath(path):
            raise PrimNotFound(f"there is no prim {path} to limit the stage to")
    mask = stage.GetPopulationMask().GetUnion(Usd.StagePopulationMask(list(_settings(stage))))
    stage.SetPopulationMask(mask)
    while wanted := {path for path in _targets(stage) if not mask.IncludesSubtree(path)}:
        mask = mask.GetUnion(Usd.StagePopulationMask(sorted(wanted)))
        stage.SetPopulationMask(mask)


def _settings(stage: Usd.Stage) -> Iterator[Sdf.Path]:
    """The render settings that the stage names."""
    path = stage.GetPseudoRoot().GetMetadata(UsdRender.Tokens.renderSettingsPrimPath)
    if path and Sdf.Path.IsValidPathString(str(path)):
        yield Sdf.Path(str(path))


def _targets(stage: Usd.Stage) -> Iterator[Sdf.Path]:
    """Prims on the stage; a collection, which a binding names too, is a property of what may be the whole stage."""
    for root in (stage.GetPseudoRoot(), *stage.GetPrototypes()):
        found = (target for prim in Usd.PrimRange(root) for target in _targets_of(prim))
        yield from (path for path in found if path.IsPrimPath() and not Usd.Prim.IsPathInPrototype(path))


def _targets_of(prim: Usd.Prim) -> Iterator[Sdf.Path]:
    for relation in prim.GetAuthoredRelationships():
        if relation.GetName().startswith(_RELATIONS):
            yield from relation.GetTargets()
    if prim.IsA(UsdShade.Shader) or prim.IsA(UsdShade.NodeGraph):
        for attribute in prim.GetAuthoredAttributes():
            yield from (target.GetPrimPath() for target in attribute.GetConnections())
