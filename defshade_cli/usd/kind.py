"""What a prim's type means to a renderer."""

from __future__ import annotations

from enum import Enum, auto
from typing import NamedTuple

from pxr import Tf, Usd, UsdGeom, UsdLux, UsdShade


class Kind(Enum):
    """GROUP: only what stands below counts.  SHADING: nothing that can be drawn stands below.

    UNDRAWN: takes room on the stage, but is no surface.  UNKNOWN: a type that no installed schema defines.
    """

    GROUP = auto()
    GPRIM = auto()
    POINT_INSTANCER = auto()
    SHADING = auto()
    UNDRAWN = auto()
    UNKNOWN = auto()


_SKEL_ROOT, _SKELETON = Tf.Type.FindByName("UsdSkelRoot"), Tf.Type.FindByName("UsdSkelSkeleton")
"""As types: the module of their schemas is imported where there are any."""

_KINDS = (
    (UsdGeom.PointInstancer, Kind.POINT_INSTANCER),
    (UsdGeom.Gprim, Kind.GPRIM),
    (UsdLux.BoundableLightBase, Kind.GROUP),
    (_SKEL_ROOT, Kind.GROUP),
    (_SKELETON, Kind.GROUP),
    (UsdGeom.Boundable, Kind.UNDRAWN),
    (UsdGeom.Subset, Kind.SHADING),
    (UsdShade.NodeGraph, Kind.SHADING),
    (UsdShade.Shader, Kind.SHADING),
)
"""The first schema that a prim is of decides."""


_BOOKKEEPING = ("HoudiniLayerInfo",)
"""Types that no schema defines and that hold nothing to draw: Solaris leaves one in each of its layers."""


class Nature(NamedTuple):
    """What follows from a prim's type alone."""

    type_name: str
    kind: Kind
    is_imageable: bool
    is_skel_root: bool


class Kinds:
    """Prims by type; the answer is the same for all of a type, and kept."""

    def __init__(self) -> None:
        self._of_type: dict[str, Nature] = {}

    def of(self, prim: Usd.Prim) -> Nature:
        """What the prim is; prims of one type are asked once."""
        type_name = prim.GetTypeName()
        if type_name not in self._of_type:
            of_prim = _classify(prim), prim.IsA(UsdGeom.Imageable), prim.IsA(_SKEL_ROOT)
            self._of_type[type_name] = Nature(type_name, *of_prim)
        return self._of_type[type_name]


def _classify(prim: Usd.Prim) -> Kind:
    if prim.GetTypeName() in _BOOKKEEPING:
        return Kind.SHADING
    if prim.GetTypeName() and not prim.GetPrimTypeInfo().GetSchemaTypeName():
        return Kind.UNKNOWN
    return next((kind for schema, kind in _KINDS if prim.IsA(schema)), Kind.GROUP)
