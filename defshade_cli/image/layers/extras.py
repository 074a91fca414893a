"""Which layers need more of a stage than its lit image does."""

from __future__ import annotations

from collections.abc import Iterable

from defshade_cli.image.layers.table import PRIMVAR_FAMILY
from defshade_cli.scene.extras import Extras


def extras_of(layers: Iterable[str]) -> Extras:
    """What the reader must read for these layers."""
    names = set(layers)
    primvars = (name.removeprefix(PRIMVAR_FAMILY) for name in names if name.startswith(PRIMVAR_FAMILY))
    return Extras(
        occlusion="occlusion" in names,
        assets="cryptoAsset" in names,
        labels="semantic" in names,
        primvars=tuple(sorted(primvars)),
        motion=bool(names & {"motionForward", "motionBackward"}),
    )
