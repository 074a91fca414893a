"""Which layers need more of a stage than its lit image does."""

from __future__ import annotations

from collections.abc import Iterable

from defshade_cli.scene.extras import Extras


def extras_of(layers: Iterable[str]) -> Extras:
    """What the reader must read for these layers."""
    names = set(layers)
    return Extras(
        occlusion="occlusion" in names,
        assets="cryptoAsset" in names,
        motion=bool(names & {"motionForward", "motionBackward"}),
    )
