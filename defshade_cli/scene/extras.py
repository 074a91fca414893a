"""What of a stage is read only because a layer asks for it."""

from __future__ import annotations

from defshade_cli.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Extras:
    """Nothing of this changes the lit image.

    occlusion: of materials.  assets: which component each prim is part of.
    labels: what each prim is, as UsdSemantics has it.  primvars: names of those to keep.
    motion: where things are a frame before and after.
    """

    occlusion: bool = False
    assets: bool = False
    labels: bool = False
    primvars: tuple[str, ...] = ()
    motion: bool = False


NO_EXTRAS = Extras()
