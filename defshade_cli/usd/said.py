"""What is authored on a prim, asked once: of many small prims, each question takes as long as a triangle's cut."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from pxr import Usd


class Said(NamedTuple):
    """path, type_name: of a prim.  names: of the properties authored on it.

    primvars: may any lie on it, its own or an ancestor's?  inherits: may an ancestor's?
    """

    path: str
    type_name: str
    names: Collection[str]
    primvars: bool
    inherits: bool = True


def said_of(
    prim: Usd.Prim, type_name: str | None = None, *, primvars_above: bool = True, clipped: bool = False
) -> Said:
    """primvars_above: may an ancestor have some?  clipped: value clips may say more than is authored, see has_clips.

    type_name: of the prim, where it is known.
    """
    names = prim.GetPropertyNames() if clipped else prim.GetAuthoredPropertyNames()
    primvars = primvars_above or "\nprimvars:" in "\n" + "\n".join(names)
    type_name = prim.GetTypeName() if type_name is None else type_name
    return Said(str(prim.GetPath()), type_name, names, primvars, primvars_above)
