"""Which material is bound to a prim, for each purpose.

USD resolves what is authored on a prim and above it (UsdShadeMaterialBindingAPI: strengths, collections, subsets).
Inside a prototype it sees nothing above the prototype's root, so bindings are kept per purpose and laid under those
of the instance by the same rule: the nearest wins, unless one from above is stronger than its descendants.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from pxr import Sdf, Usd, UsdShade

from defshade_cli.usd.materials.bindings import NOTHING_BOUND, Binding, Bindings
from defshade_cli.usd.said import Said, binding_names

_DIRECT = str(UsdShade.Tokens.materialBinding)
_ONLY_DIRECT = (_DIRECT,)
_BINDING_API = "MaterialBindingAPI"


class Bound(NamedTuple):
    """The bindings that USD resolves for a prim.

    by_collection: some on it or above it bind what a collection holds.  by_purpose: some are for one purpose alone.
    """

    bindings: Bindings
    by_collection: bool
    by_purpose: bool


NOTHING_ABOVE = Bound(NOTHING_BOUND, by_collection=False, by_purpose=False)


Known = dict[Sdf.Path, tuple[Bound, Bound] | None]
"""Materials by path: what binds them, weaker and stronger than descendants; None for what is no material."""


def read_bound(prim: Usd.Prim, above: Bound, known: Known, said: Said | None = None) -> Bound:
    """Of a prim whose parent has `above`: the same, unless it has bindings of its own or a collection may hold it.

    said: of the prim, where it is known.  known: takes what is found.
    """
    own = binding_names(prim.GetAuthoredPropertyNames()) if said is None else said.binding
    if not own and not above.by_collection:
        return above
    if own == _ONLY_DIRECT and not (above.by_collection or above.by_purpose):
        schemas = prim.GetAppliedSchemas() if said is None else said.schemas
        relationship = prim.GetRelationship(_DIRECT) if said is None else said.properties[_DIRECT]
        direct = _direct(relationship, schemas, known)
        if direct:
            there = above.bindings.all_purpose
            return above if there and there.stronger else direct
    by_collection = above.by_collection or any(":collection:" in name for name in own)
    by_purpose = above.by_purpose or any(":full" in name or ":preview" in name for name in own)
    return Bound(_resolve(prim, by_purpose=by_purpose), by_collection, by_purpose)


def _direct(relationship: Usd.Property, schemas: Sequence[str], known: Known) -> Bound | None:
    """The one material that a relationship of a prim's own binds; None where it is for USD to say what holds."""
    if _BINDING_API not in schemas or not isinstance(relationship, Usd.Relationship):
        return None
    targets = relationship.GetTargets()
    if len(targets) != 1:
        return None
    target = targets[0]
    if target not in known:
        material = relationship.GetStage().GetPrimAtPath(target)
        is_one = bool(material) and material.IsA(UsdShade.Material)
        known[target] = (_bound_to(target, stronger=False), _bound_to(target, stronger=True)) if is_one else None
    bound = known[target]
    strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(relationship)
    return bound and bound[strength == UsdShade.Tokens.strongerThanDescendants]


def _bound_to(material: Sdf.Path, *, stronger: bool) -> Bound:
    """For all purposes."""
    return Bound(Bindings(all_purpose=Binding(material, stronger)), by_collection=False, by_purpose=False)


def _resolve(prim: Usd.Prim, *, by_purpose: bool) -> Bindings:
    """What is bound to `prim`, a gprim, a subset or an instance, by its own stage hierarchy."""
    api = UsdShade.MaterialBindingAPI(prim)
    _, everywhere = api.ComputeBoundMaterial()
    if not by_purpose:
        return Bindings(all_purpose=_binding(everywhere))
    full, preview = (
        _binding(relationship) if relationship != everywhere else None
        for purpose in (UsdShade.Tokens.full, UsdShade.Tokens.preview)
        for _, relationship in [api.ComputeBoundMaterial(purpose)]
    )
    return Bindings(full, preview, _binding(everywhere))


def _binding(relationship: Usd.Relationship) -> Binding | None:
    """The relationship of a collection targets the collection too, which is a property."""
    targets = relationship.GetForwardedTargets() if relationship else ()
    material = next((target for target in targets if target.IsPrimPath()), None)
    strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(relationship) if material else None
    return Binding(material, strength == UsdShade.Tokens.strongerThanDescendants) if material else None
