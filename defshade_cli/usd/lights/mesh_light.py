"""Lights made of geometry: MeshLightAPI, LightAPI on any surface, and GeometryLight.

materialSyncMode says what the bound material has to do with the light. `materialGlowTintsLight`: its emissive colour
tints the light, and the surface is seen as the material has it; a surface without material counts as white.
`independent`: the same, untinted. `noMaterialResponse`: the surface reflects nothing and shows the light's radiance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.light import Light
from defshade_cli.scene.material import UNBOUND, Material
from defshade_cli.scene.mesh_light import MeshLight
from defshade_cli.usd.instancing.instancing import Piece
from defshade_cli.usd.materials.bindings import Bindings
from defshade_cli.usd.surfaces.geometry import Gprim

_TINTED, _SILENT = "materialGlowTintsLight", "noMaterialResponse"
_WHITE = (1.0, 1.0, 1.0)

MaterialOf = Callable[[Bindings], Material]


@dataclass(frozen=True, slots=True, eq=False)
class Glow:
    """What makes a surface a light.

    light: without its triangles.  mode: materialSyncMode.
    surface: path of another prim that is the light's shape, as a GeometryLight names it.
    """

    light: MeshLight
    mode: str
    surface: str | None = None


Glows = Mapping[str, Glow]
"""By the path of the surface."""


def is_mesh_light(prim: Usd.Prim) -> bool:
    """Points would be a light each; volumes have no surface."""
    return prim.IsA(UsdLux.GeometryLight) or (prim.IsA(UsdGeom.Gprim) and not prim.IsA(UsdGeom.Points))


def read_glow(prim: Usd.Prim, **common: object) -> Glow | None:
    """common: what all lights share. None for a GeometryLight that names no geometry."""
    light = MeshLight(
        path=str(prim.GetPath()),
        world_from_light=np.eye(4),
        corners=np.empty((0, 3, 3)),
        tints=np.empty((0, 3)),
        **common,  # type: ignore[arg-type]
    )
    mode = str(UsdLux.LightAPI(prim).GetMaterialSyncModeAttr().Get())
    if not prim.IsA(UsdLux.GeometryLight):
        return Glow(light, mode)
    targets = UsdLux.GeometryLight(prim).GetGeometryRel().GetForwardedTargets()
    return Glow(light, mode, str(targets[0])) if targets else None


def glowing_lights(piece: Piece, gprim: Gprim, glow: Glow, material_of: MaterialOf) -> Iterator[Light]:
    """The lights that a surface is, one a placement."""
    corners = gprim.mesh.points[gprim.mesh.triangles].astype(np.float64)
    tints = np.zeros((len(corners), 3))
    for group in gprim.groups:
        tint = _tint(material_of(piece.bindings[group.path])) if glow.mode == _TINTED else _WHITE
        tints[group.first : group.first + group.count] = tint
    count = len(piece.root_from_object)
    paths = piece.paths if len(piece.paths) == count else piece.paths * count
    for path, placed in zip(paths, piece.root_from_object, strict=True):
        where = glow.light.path if glow.surface else path
        yield replace(glow.light, path=where, world_from_light=placed, corners=corners, tints=tints)


def shown_material(bound: Material, glow: Glow, light: Light) -> Material:
    """What a surface shows: a black one that emits the light's radiance where its material does not count."""
    if glow.mode != _SILENT:
        return bound
    emitted = tuple(light.radiance.tolist())
    return Material(f"{light.path}<glow>", diffuse_color=(0, 0, 0), metallic=1.0, roughness=1.0, emissive_color=emitted)


def _tint(material: Material) -> tuple[float, float, float]:
    return _WHITE if material is UNBOUND else material.emissive_color
