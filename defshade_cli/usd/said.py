"""What is authored on a prim, asked once: of many small prims, each question takes as long as a triangle's cut."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import field
from functools import lru_cache
from typing import Any, NamedTuple

from pxr import Usd, UsdGeom

from defshade_cli.dataclass import dataclass

_PRIMVARS, _INDICES, _NORMALS, _MATERIALS = "primvars:", ":indices", "primvars:normals", "material:"


@dataclass(frozen=True, slots=True, eq=False)
class Inherited:
    """Primvars that a prim hands down to all below it: constant ones, its own or its ancestors'.

    read: takes what is made of them, which is the same for thousands of prims.
    """

    primvars: Sequence[UsdGeom.Primvar]
    read: dict[Hashable, Any] = field(default_factory=dict)


NOTHING_INHERITED = Inherited(())


def inheritable(prim: Usd.Prim) -> Inherited:
    """What USD finds on a prim and above it for what stands below."""
    found = UsdGeom.PrimvarsAPI(prim).FindInheritablePrimvars() if prim else ()
    return Inherited(found) if found else NOTHING_INHERITED


class Said(NamedTuple):
    """path, type_name: of a prim.  names: of the properties authored on it.

    lying: those of its own primvars that may be colours or texture coordinates, in order.
    binding: those of its relationships to materials, likewise.
    schemas: applied to it, those of its type too.
    is_leaf: no prim at all stands below; an instance is one.
    own_primvars: are any authored on it?  inherited: those of its ancestors.
    """

    path: str
    type_name: str
    names: frozenset[str]
    lying: tuple[str, ...]
    binding: tuple[str, ...]
    schemas: Sequence[str]
    is_leaf: bool
    own_primvars: bool
    inherited: Inherited

    @property
    def primvars(self) -> bool:
        """May any lie on it?"""
        return self.own_primvars or self.inherited is not NOTHING_INHERITED


class _Names(NamedTuple):
    """As in Said. primvars: is there any?"""

    every: frozenset[str]
    lying: tuple[str, ...]
    binding: tuple[str, ...]
    primvars: bool


def said_of(
    prim: Usd.Prim, type_name: str | None = None, inherited: Inherited | None = None, *, clipped: bool = False
) -> Said:
    """type_name, inherited: of the prim, where they are known.

    clipped: value clips may say more than is authored, see has_clips.
    """
    names, lying, binding, primvars = _sorted_out(
        tuple(prim.GetPropertyNames() if clipped else prim.GetAuthoredPropertyNames())
    )
    return Said(
        str(prim.GetPath()),
        prim.GetTypeName() if type_name is None else type_name,
        names,
        lying,
        binding,
        prim.GetAppliedSchemas(),
        not prim.GetAllChildrenNames(),
        primvars,
        inheritable(prim.GetParent()) if inherited is None else inherited,
    )


@lru_cache(maxsize=1 << 12)
def _sorted_out(names: tuple[str, ...]) -> _Names:
    """Prims that are exported alike have the same names on them."""
    primvars = [name for name in names if name.startswith(_PRIMVARS)]
    lying = tuple([name for name in primvars if not name.endswith(_INDICES) and name != _NORMALS])
    return _Names(frozenset(names), lying, binding_names(names), bool(primvars))


def binding_names(names: Iterable[str]) -> tuple[str, ...]:
    """Those of relationships to materials."""
    return tuple([name for name in names if name.startswith(_MATERIALS)])
