"""Native instances: gathered while a subtree is walked, then placed together by prototype."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from pxr import Gf, Sdf, Usd

from defshade_cli.usd.binding import Bindings
from defshade_cli.usd.instancing import Placement, Standing, read_display_of_instances
from defshade_cli.usd.memory import Memory
from defshade_cli.usd.xform import matrices


class Sharing(NamedTuple):
    """What instances have in common that are placed together."""

    prototype: Sdf.Path
    bindings: Bindings
    in_world: bool
    purpose: str | None


class Instance(NamedTuple):
    """order: among the instances of its prototype in the subtree."""

    prim: Usd.Prim
    root_from_prim: Gf.Matrix4d
    order: int


class NativeInstances:
    """The native instances of one subtree.

    issues: by instance, what of it was left out.
    """

    def __init__(self, memory: Memory) -> None:
        self.issues: dict[Usd.Prim, list[str]] = {}
        self._memory = memory
        self._met: Counter[Sdf.Path] = Counter()
        self._shared: dict[Sharing, list[Instance]] = defaultdict(list)

    def add(self, prim: Usd.Prim, here: Standing) -> None:
        prototype = prim.GetPrototype().GetPath()
        sharing = Sharing(prototype, self._memory.bindings(prim.GetPath()), here.in_world, here.purpose)
        self._shared[sharing].append(Instance(prim, here.root_from_prim, self._met[prototype]))
        self._met[prototype] += 1

    def placements(self, time: Usd.TimeCode) -> Iterator[tuple[Usd.Prim, Placement]]:
        """Each prototype, as often as its instances differ in what they share, with their placement."""
        for sharing, instances in self._shared.items():
            prototype = instances[0].prim.GetPrototype()
            yield prototype, self._placement(prototype, sharing, instances, time)

    def _placement(
        self, prototype: Usd.Prim, sharing: Sharing, instances: list[Instance], time: Usd.TimeCode
    ) -> Placement:
        displays = [
            read_display_of_instances(instance.prim, time, 1, self.issues.setdefault(instance.prim, []))
            for instance in instances
        ]
        return Placement(
            matrices([instance.root_from_prim for instance in instances]),
            np.array([instance.order for instance in instances], np.int32),
            np.concatenate([color for color, _ in displays]),
            np.concatenate([opacity for _, opacity in displays]),
            sharing.purpose,
            sharing.bindings,
            sharing.in_world,
            prototype=self._memory.name_prototype(prototype, instances[0].prim),
            roots=tuple(self._memory.shown(instance.prim.GetPath()) for instance in instances),
        )
