"""Native instances: gathered while a subtree is walked, then placed together by prototype."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd

from defshade_cli.usd.instancing.instancing import (
    Piece,
    Placement,
    Standing,
    read_color_of_instances,
    read_display_of_instances,
    some,
)
from defshade_cli.usd.materials.bindings import Bindings
from defshade_cli.usd.memory import Memory
from defshade_cli.usd.surfaces.geometry import Surface
from defshade_cli.usd.xform import matrices


class Sharing(NamedTuple):
    """What instances have in common that are placed together.

    animation: that their skeletons inherit.  by_collection: may collections bind what is inside them?
    """

    prototype: Sdf.Path
    animation: Sdf.Path | None
    bindings: Bindings
    by_collection: bool
    in_world: bool
    purpose: str | None


class Instance(NamedTuple):
    """order: among the instances of its prototype in the subtree."""

    prim: Usd.Prim
    here: Standing
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
        """Note an instance, with those that share its prototype and all that it inherits."""
        prototype = prim.GetPrototype().GetPath()
        animation = self._memory.rigs.animation_of(here.on_stage(prim))
        bindings, by_collection, _ = self._memory.materials.bound(prim.GetPath())
        sharing = Sharing(prototype, animation, bindings, by_collection, here.in_world, here.purpose)
        self._shared[sharing].append(Instance(prim, here, self._met[prototype]))
        self._met[prototype] += 1

    def placements(self, time: Usd.TimeCode) -> Iterator[tuple[Sharing, Instance, Placement]]:
        """What some instances share, the first of them, and the placement of all, for each prototype and difference."""
        for sharing, instances in self._shared.items():
            yield sharing, instances[0], self._placement(sharing, instances, time)

    def _placement(self, sharing: Sharing, instances: list[Instance], time: Usd.TimeCode) -> Placement:
        first = instances[0].prim
        displays = [
            read_display_of_instances(instance.prim, time, 1, self.issues.setdefault(instance.prim, []))
            for instance in instances
        ]

        def other_color(primvar: str) -> NDArray[np.float32]:
            issues = [self.issues[instance.prim] for instance in instances]
            read = (
                read_color_of_instances(i.prim, time, 1, told, primvar)
                for i, told in zip(instances, issues, strict=True)
            )
            return np.concatenate([*read])

        return Placement(
            matrices([instance.here.root_from_prim for instance in instances]),
            np.array([instance.order for instance in instances], np.int32),
            np.concatenate([color for color, _ in displays]),
            np.concatenate([opacity for _, opacity in displays]),
            sharing.purpose,
            sharing.bindings,
            sharing.in_world,
            prototype=self._memory.names.name_prototype(first.GetPrototype(), first),
            roots=tuple(self._memory.names.shown(instance.prim.GetPath()) for instance in instances),
            other_color=cache(other_color),
        )


def rebound(piece: Piece, memory: Memory, instance: Usd.Prim) -> Iterator[Piece]:
    """A piece of some instances in parts, bound as USD resolves it where they are: collections may hold what is in one.

    piece: as placed; its bindings are by the paths of groups in the prototype.
    instance: one of them. Where it is itself in a prototype, what is bound outside is laid under later.
    """
    surface = piece.content
    if not isinstance(surface, Surface) or any("." in group for group in piece.bindings):  # stand-ins bind themselves
        yield piece
        return
    below = [memory.names.shown(group)[len(surface.path) :] for group in piece.bindings]
    paths = [memory.names.on_stage(path, instance.GetPath()) for path in piece.paths]
    found = [tuple(memory.materials.bindings(path + end) for end in below) for path in paths]
    for bindings in dict.fromkeys(found):
        part = piece if len(found) == 1 else some(piece, np.array([each == bindings for each in found]))
        yield replace(part, bindings=dict(zip(piece.bindings, bindings, strict=True)))
