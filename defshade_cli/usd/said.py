"""What is authored on a prim, asked once: of many small prims, each question takes as long as a triangle's cut."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import field
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

from pxr import Usd, UsdGeom

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.materials.bindings import NOTHING_BOUND, Bindings

_PRIMVARS, _INDICES, _NORMALS, _MATERIALS = "primvars:", ":indices", "primvars:normals", "material:"


@dataclass(frozen=True, eq=False)
class Inherited:
    """Primvars that a prim hands down to all below it, its own and its ancestors'; of no prim none.

    read: takes what is made of them, which is the same for thousands of prims.
    """

    prim: Usd.Prim | None
    read: dict[Hashable, Any] = field(default_factory=dict)

    @cached_property
    def primvars(self) -> Sequence[UsdGeom.Primvar]:
        """As USD finds them: the constant ones."""
        return UsdGeom.PrimvarsAPI(self.prim).FindInheritablePrimvars() if self.prim else ()


NOTHING_INHERITED = Inherited(None)


@dataclass(frozen=True, eq=False)
class Said:
    """path, type_name: of a prim.  names: of the properties authored on it.

    properties: by name, those of a surface: USD makes all of them in the time that it takes for a few one by one.
    lying: those of its own primvars that may be colours or texture coordinates, in order.
    binding: those of its relationships to materials, likewise.
    own_primvars: are any authored on it?  inherited: those of its ancestors.
    schemas: applied to it, those of its type too.
    is_leaf: no prim at all stands below; an instance is one.
    outer: what is bound outside the prototype that it is in, see Materials.outer.
    """

    path: str
    type_name: str
    properties: Mapping[str, Usd.Property]
    names: frozenset[str]
    lying: tuple[str, ...]
    binding: tuple[str, ...]
    own_primvars: bool
    inherited: Inherited
    schemas: Sequence[str]
    is_leaf: bool
    outer: Bindings = NOTHING_BOUND

    @property
    def key(self) -> Hashable:
        """Of what is read of the prim."""
        return (self.path, self.outer) if any(self.outer) else self.path

    @property
    def primvars(self) -> bool:
        """Does any lie on it?"""
        return self.own_primvars or bool(self.inherited.primvars)

    def value(self, name: str, time: Usd.TimeCode) -> Any:
        """Of an attribute that is authored, or None."""
        found = self.properties.get(name)
        return found.Get(time) if isinstance(found, Usd.Attribute) else None


class _Names(NamedTuple):
    """As in Said."""

    names: frozenset[str]
    lying: tuple[str, ...]
    binding: tuple[str, ...]
    own_primvars: bool


def said_of(
    prim: Usd.Prim,
    type_name: str | None = None,
    inherited: Inherited | None = None,
    *,
    is_surface: bool = True,
    clipped: bool = False,
    outer: Bindings = NOTHING_BOUND,
) -> Said:
    """type_name, inherited: of the prim, where they are known.

    clipped: value clips may say more than is authored, see has_clips.
    """
    names = tuple(prim.GetPropertyNames() if clipped else prim.GetAuthoredPropertyNames())
    properties = (prim.GetProperties() if clipped else prim.GetAuthoredProperties()) if is_surface else ()
    return Said(
        str(prim.GetPath()),
        prim.GetTypeName() if type_name is None else type_name,
        dict(zip(names, properties, strict=is_surface)),
        *_sorted_out(names),
        Inherited(prim.GetParent()) if inherited is None else inherited,
        prim.GetAppliedSchemas(),
        not prim.GetAllChildrenNames(),
        outer,
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
