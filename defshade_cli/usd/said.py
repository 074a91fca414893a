"""What is authored on a prim, asked once: of many small prims, each question takes as long as a triangle's cut."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import NamedTuple

from pxr import Usd

_PRIMVARS, _INDICES, _NORMALS, _MATERIALS = "primvars:", ":indices", "primvars:normals", "material:"


class Said(NamedTuple):
    """path, type_name: of a prim.  names: of the properties authored on it.

    lying: those of its own primvars that may be colours or texture coordinates, in order.
    binding: those of its relationships to materials, likewise.
    schemas: applied to it, those of its type too.
    is_leaf: no prim at all stands below; an instance is one.
    primvars: may any lie on it, its own or an ancestor's?  inherits: may an ancestor's?
    """

    path: str
    type_name: str
    names: frozenset[str]
    lying: tuple[str, ...]
    binding: tuple[str, ...]
    schemas: Sequence[str]
    is_leaf: bool
    primvars: bool
    inherits: bool = True


class _Names(NamedTuple):
    """As in Said. primvars: is there any?"""

    every: frozenset[str]
    lying: tuple[str, ...]
    binding: tuple[str, ...]
    primvars: bool


def said_of(
    prim: Usd.Prim, type_name: str | None = None, *, primvars_above: bool = True, clipped: bool = False
) -> Said:
    """primvars_above: may an ancestor have some?  clipped: value clips may say more than is authored, see has_clips.

    type_name: of the prim, where it is known.
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
        primvars or primvars_above,
        primvars_above,
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
