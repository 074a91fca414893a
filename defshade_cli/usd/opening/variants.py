"""Variants that the user chooses, over what the stage says."""

from __future__ import annotations

from collections.abc import Sequence

from pxr import Usd

from defshade_cli.errors import PrimNotFound
from defshade_cli.settings import VariantChoice


def choose_variant(stage: Usd.Stage, choice: VariantChoice) -> None:
    """Select it in the session layer. Raises PrimNotFound where the stage has no such prim, set or variant."""
    prim = stage.GetPrimAtPath(choice.prim)
    if not prim:
        raise PrimNotFound(f"{choice}: there is no prim {choice.prim}")
    if prim.IsInstanceProxy() or prim.IsInPrototype():
        raise PrimNotFound(f"{choice}: {choice.prim} stands inside an instance, which has its variants from its source")
    sets = prim.GetVariantSets()
    if choice.set not in sets.GetNames():
        raise PrimNotFound(f"{choice}: {choice.prim} has {_known('variant set', sets.GetNames())}")
    variants = sets.GetVariantSet(choice.set)
    if choice.variant and choice.variant not in variants.GetVariantNames():
        raise PrimNotFound(f"{choice}: variant set {choice.set} has {_known('variant', variants.GetVariantNames())}")
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        variants.SetVariantSelection(choice.variant) if choice.variant else variants.BlockVariantSelection()


def _known(noun: str, names: Sequence[str]) -> str:
    return f"the {noun}s {', '.join(names)}" if names else f"no {noun}s"
