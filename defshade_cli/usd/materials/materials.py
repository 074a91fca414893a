"""The materials of a stage and what binds them, read once where they do not change over time."""

from __future__ import annotations

from collections.abc import Iterable

from pxr import Sdf, Usd, UsdGeom

from defshade_cli.usd.blame import blamed
from defshade_cli.usd.materials.binding import NOTHING_ABOVE, Bound, Known, read_bound
from defshade_cli.usd.materials.bindings import NOTHING_BOUND, Bindings
from defshade_cli.usd.materials.material import ReadMaterial, not_understood, read_material
from defshade_cli.usd.models import draw_mode
from defshade_cli.usd.names import Names
from defshade_cli.usd.polygons.primvars import DISPLAY_COLOR
from defshade_cli.usd.said import Said


class Materials:
    """Of one stage. occlusion: what a layer needs of them is read too."""

    def __init__(self, stage: Usd.Stage, names: Names, *, occlusion: bool) -> None:
        self.stage, self._names, self._occlusion = stage, names, occlusion
        self._known: dict[Sdf.Path, ReadMaterial] = {}
        self._bindings: dict[str, Bound] = {"/": NOTHING_ABOVE}
        self._bound_directly: Known = {}
        self._colors: dict[Bindings, str] = {}

    def read(self, path: Sdf.Path, time: Usd.TimeCode) -> ReadMaterial:
        """The material at a path; read once where it does not change over time."""
        if path in self._known:
            return self._known[path]
        try:
            read = self._read(path, time)
        except Exception as error:  # a bug goes on as one
            reason = blamed(error, self.stage.GetPrimAtPath(path.GetPrimPath()))
            read = not_understood(self._names.shown(path), reason)
        if not read.time_varying:
            self._known[path] = read
        return read

    def _read(self, path: Sdf.Path, time: Usd.TimeCode) -> ReadMaterial:
        if path.IsPropertyPath():
            return draw_mode.read_material(self.stage, path, self._names.shown(path))
        return read_material(self.stage, path, self._names.shown(path), time, occlusion=self._occlusion)

    def bindings(self, path: Sdf.Path | str) -> Bindings:
        """Relationships do not vary over time."""
        return self._bound(str(path)).bindings

    def bound(self, path: Sdf.Path) -> Bound:
        """The same, with whether a prim, or one above it, binds what a collection holds."""
        return self._bound(str(path))

    def _bound(self, path: str, prim: Usd.Prim | None = None, said: Said | None = None) -> Bound:
        """From the nearest prim above whose bindings are known, downwards. prim, said: of the path, where known."""
        known = self._bindings.get(path)
        if known is not None:
            return known
        above: list[str] = []
        while (parent := (above[-1] if above else path).rpartition("/")[0] or "/") not in self._bindings:
            above.append(parent)
        bound = self._bindings[parent]
        for each in reversed(above):
            bound = self._bindings[each] = read_bound(self.stage.GetPrimAtPath(each), bound, self._bound_directly)
        prim = prim or self.stage.GetPrimAtPath(path)
        bound = self._bindings[path] = read_bound(prim, bound, self._bound_directly, said)
        return bound

    def color_of(self, prim: Usd.Prim, said: Said, subsets: Iterable[UsdGeom.Subset], time: Usd.TimeCode) -> str:
        """What stands for displayColor: the primvar that a material bound to the prim reads its colour from."""
        bound = [self._bound(said.path, prim, said), *[self._bound(str(s.GetPath()), s.GetPrim()) for s in subsets]]
        return self.color_by([each.bindings.under(said.outer) for each in bound], time)

    def color_by(self, bound: Iterable[Bindings], time: Usd.TimeCode) -> str:
        """The same of what is bound to a prim and its subsets, in order."""
        return next((color for each in bound if (color := self._color_by(each, time))), DISPLAY_COLOR)

    def outer(self, bindings: Bindings, time: Usd.TimeCode) -> Bindings:
        """What is bound outside a prototype, as far as its surfaces may be read otherwise for it: by their colours.

        That is by another primvar than displayColor, or by this one in place of what is bound inside.
        """
        stronger = (self.read(binding.material, time) for binding in bindings if binding and binding.stronger)
        reads_color = any(read.understood and read.material.uses_display_color for read in stronger)
        return bindings if reads_color or self._color_by(bindings, time) else NOTHING_BOUND

    def _color_by(self, bindings: Bindings, time: Usd.TimeCode) -> str:
        """The same of some bindings, empty where none does; found once for all prims with these."""
        if bindings == NOTHING_BOUND:
            return ""
        color = self._colors.get(bindings)
        if color is None:
            read = (self.read(path, time).material.color_primvar for path in bindings.candidates)
            color = next((name for name in read if name), "")
            if all(path in self._known for path in bindings.candidates):
                self._colors[bindings] = color
        return color
