"""The materials of one frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from pxr import Usd

from defshade_cli.scene.material import UNBOUND, Material
from defshade_cli.scene.scene import Unsupported
from defshade_cli.usd.instancing.instancing import Piece, some
from defshade_cli.usd.materials.bindings import PURPOSES, Bindings
from defshade_cli.usd.materials.materials import Materials
from defshade_cli.usd.materials.worn import Value, on_mesh, read_values, with_primvars
from defshade_cli.usd.surfaces.geometry import Gprim


class Palette:
    """Materials numbered in order of first use.

    Of the materials bound to a prim the first that is understood is taken, in the order of `purposes`:
    a production look that only its own renderer knows gives way to the UsdPreviewSurface beside it. Where none is
    understood, the first is reported, once. known: the materials of the stage.
    """

    def __init__(self, known: Materials, time: Usd.TimeCode, purposes: Sequence[str] = PURPOSES) -> None:
        self.issues: dict[Unsupported, None] = {}
        self._known, self._time, self._purposes = known, time, purposes
        self._numbers: dict[Material, int] = {}
        self._chosen: dict[Bindings, Material] = {}

    @property
    def materials(self) -> tuple[Material, ...]:
        """In the order of their numbers."""
        return tuple(self._numbers)

    def number_of(self, material: Material) -> int:
        """Index into `materials`, of which it becomes one."""
        return self._numbers.setdefault(material, len(self._numbers))

    def material(self, bindings: Bindings) -> Material:
        """The one that is drawn."""
        chosen = self._chosen.get(bindings)
        if chosen is None:
            chosen = self._chosen[bindings] = self._choose(bindings)
        return chosen

    def worn(self, piece: Piece, gprim: Gprim) -> Iterator[tuple[Piece, list[Material]]]:
        """The piece with the material of each group; in parts, where the prims have primvars that these read."""
        materials = [on_mesh(self.material(piece.bindings[group.path]), gprim.mesh) for group in gprim.groups]
        names = tuple(dict.fromkeys(name for material in materials for name in material.primvars.values()))
        if not names:
            yield piece, materials
            return
        read = [read_values(self._known.stage, path, names, self._time, self.issues) for path in piece.paths]
        for values in dict.fromkeys(read):
            part = piece if len(read) == 1 else some(piece, np.array([each == values for each in read]))
            yield part, [self._filled(material, dict(zip(names, values, strict=True))) for material in materials]

    def _filled(self, material: Material, values: Mapping[str, Value]) -> Material:
        reasons: list[str] = []
        filled = with_primvars(material, values, reasons)
        self.issues.update(dict.fromkeys(Unsupported(material.path, f"without {reason}") for reason in reasons))
        return filled

    def _choose(self, bindings: Bindings) -> Material:
        candidates = [self._known.read(path, self._time) for path in bindings.candidates_for(self._purposes)]
        if not candidates:
            return UNBOUND
        chosen = next((candidate for candidate in candidates if candidate.understood), candidates[0])
        self.issues.update(dict.fromkeys(chosen.issues))
        return chosen.material
