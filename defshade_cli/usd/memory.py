"""What stays the same from frame to frame, read once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from pxr import Sdf, Usd, UsdGeom

from defshade_cli.scene.extras import NO_EXTRAS, Extras
from defshade_cli.scene.texture import SeenFrom
from defshade_cli.usd.blame import blamed
from defshade_cli.usd.kind import Kinds
from defshade_cli.usd.materials.binding import NOTHING_ABOVE, NOTHING_BOUND, Bindings, Bound, Known, read_bound
from defshade_cli.usd.materials.material import ReadMaterial, not_understood, read_material
from defshade_cli.usd.models import draw_mode
from defshade_cli.usd.opening.stage import has_clips
from defshade_cli.usd.polygons.checked import check_all
from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.polygons.positions import is_carried_by_velocities
from defshade_cli.usd.polygons.primvars import DISPLAY_COLOR
from defshade_cli.usd.polygons.shapes import Shapes
from defshade_cli.usd.polygons.subsets import material_subsets
from defshade_cli.usd.polygons.told import Told, told_of
from defshade_cli.usd.said import Said
from defshade_cli.usd.sharing import shared
from defshade_cli.usd.surfaces.geometry import (
    Shape,
    Surface,
    is_time_varying,
    move_surface,
    only_points_vary,
    read_surface,
    surface_of,
)

if TYPE_CHECKING:
    from defshade_cli.usd.skel import Rigs

T = TypeVar("T")


class Asked(NamedTuple):
    """What a mesh says of itself."""

    subsets: list[UsdGeom.Subset]
    told: Told


def _tried(step: Callable[..., T], *arguments: Any) -> T | Exception:
    try:
        return step(*arguments)
    except Exception as error:  # for where it can be said of what
        return error


class Memory:
    """The unchanging parts of one stage, and the names of what stands in its prototypes.

    seen_from: for cards placed by their textures.
    as_cages: what is round is what Hydra draws of it: see gprims.read_solid, and facing.
    stage: what is read.  kinds: of prims.  clipped: see stage.has_clips.  instanced: are there native instances?
    xforms: USD's cache, which drops only what varies when its time is set.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        extras: Extras = NO_EXTRAS,
        *,
        as_cages: bool = False,
        seen_from: SeenFrom | None = None,
    ) -> None:
        self.kinds = Kinds()
        self.clipped = has_clips(stage)
        self.instanced = bool(stage.GetPrototypes())
        self.xforms = UsdGeom.XformCache()
        self.stage, self._extras, self._as_cages = stage, extras, as_cages
        self._shapes = Shapes()
        self._surfaces: dict[str, tuple[Usd.TimeCode, Surface | None]] = {}
        self._time_varying: dict[str, bool] = {}
        self._bindings: dict[str, Bound] = {"/": NOTHING_ABOVE}
        self._materials: dict[Sdf.Path, ReadMaterial] = {}
        self._bound_directly: Known = {}
        self._colors: dict[Bindings, str] = {}
        self._first_instances: dict[str, str] = {}
        self._models = draw_mode.StandIns(seen_from)
        self._stand_ins: dict[tuple[Sdf.Path, str], Surface] = {}

    @cached_property
    def rigs(self) -> Rigs:
        """What skeletons deform."""
        from defshade_cli.usd.skel import Rigs

        return Rigs()

    def surface_around(self, prim: Usd.Prim, time: Usd.TimeCode, base: Usd.TimeCode, said: Said) -> Surface | None:
        """The surface at a time near `base`, a frame. A mesh that velocities carry has what it has at the frame.

        So its points keep their number while the shutter is open, whatever samples lie within.
        """
        if time == base or not prim.IsA(UsdGeom.Mesh) or not is_carried_by_velocities(prim, time):
            return self.surface(prim, time, said)
        rest = self.surface(prim, base, said)
        return (move_surface(rest, prim, time, base) if rest and rest.groups else None) or rest

    def surface(self, prim: Usd.Prim, time: Usd.TimeCode, said: Said) -> Surface | None:
        """The same object at every time, unless something of the prim varies."""
        time_read, known = self._surfaces.get(said.path, (None, None))
        if time_read is not None and (time == time_read or not self._is_time_varying(prim, said)):
            return known
        surface = self._at_another_time(known, prim, time, said) if known else self._read_surface(prim, time, said)
        self._surfaces[said.path] = time, surface
        return surface

    def is_unknown_mesh(self, said: Said) -> bool:
        """Is it one to be asked with others?"""
        return said.type_name == "Mesh" and not self._extras.primvars and said.path not in self._surfaces

    def new_surfaces(
        self, prims: Sequence[Usd.Prim], saids: Sequence[Said], time: Usd.TimeCode
    ) -> list[Surface | Exception]:
        """Of unknown meshes, or what went wrong.

        They are asked one after the other, with nothing between: the processor keeps what it does to each.
        """
        asked = [_tried(self._ask, prim, said, time) for prim, said in zip(prims, saids, strict=True)]
        checked = iter(check_all([each.told for each in asked if isinstance(each, Asked)]))
        found = [(each, next(checked) if isinstance(each, Asked) else None) for each in asked]
        return [
            _tried(self._new_surface, prim, said, *each, time)
            for prim, said, each in zip(prims, saids, found, strict=True)
        ]

    def _ask(self, prim: Usd.Prim, said: Said, time: Usd.TimeCode) -> Asked | None:
        """What an unknown mesh says, to be looked into with others; None of one that is to be read by itself."""
        subsets = [] if said.is_leaf else material_subsets(prim)
        told = told_of(said, time, self._color_of(prim, said, subsets, time))
        return told and Asked(subsets, told)

    def _new_surface(
        self,
        prim: Usd.Prim,
        said: Said,
        asked: Asked | Exception | None,
        polygons: Polygons | None,
        time: Usd.TimeCode,
    ) -> Surface:
        """polygons: as checked, None of what is not sound."""
        if isinstance(asked, Exception):
            raise asked
        if asked is None or polygons is None:
            surface = self._read_surface(prim, time, said)
            assert surface is not None
        else:
            shape = Shape(polygons)
            surface = self._as_shown(surface_of(prim, said, time, shape, self._shapes, asked.subsets, []))
        self._surfaces[said.path] = time, surface
        return surface

    def _at_another_time(self, known: Surface, prim: Usd.Prim, time: Usd.TimeCode, said: Said) -> Surface | None:
        """Read is no more than varies; what turns out to be equal stays the same object."""
        shown = self._color_of(prim, said, material_subsets(prim), time), self._extras.primvars
        moved = move_surface(known, prim, time) if known.groups and only_points_vary(prim, *shown) else None
        return shared(moved or self._read_surface(prim, time, said), known)

    def _read_surface(self, prim: Usd.Prim, time: Usd.TimeCode, said: Said) -> Surface | None:
        subsets = material_subsets(prim)
        surface = read_surface(
            prim,
            time,
            self._color_of(prim, said, subsets, time),
            self._extras.primvars,
            self._shapes,
            as_cages=self._as_cages,
            said=said,
            subsets=subsets,
        )
        return surface and self._as_shown(surface)

    def stand_in(self, prim: Usd.Prim, mode: str) -> Surface:
        """What is drawn of a model in a draw mode; it does not vary over time."""
        key = prim.GetPath(), mode
        if key not in self._stand_ins:
            self._stand_ins[key] = self._as_shown(self._models.read(prim, mode))
        return self._stand_ins[key]

    def _color_of(self, prim: Usd.Prim, said: Said, subsets: Iterable[UsdGeom.Subset], time: Usd.TimeCode) -> str:
        """What stands for displayColor: the primvar that a material bound to the prim reads its colour from."""
        bound = [self._bound(said.path, prim, said), *[self._bound(str(s.GetPath()), s.GetPrim()) for s in subsets]]
        return next((color for each in bound if (color := self._color_by(each.bindings, time))), DISPLAY_COLOR)

    def _color_by(self, bindings: Bindings, time: Usd.TimeCode) -> str:
        """The same of some bindings, empty where none does; found once for all prims with these."""
        if bindings == NOTHING_BOUND:
            return ""
        color = self._colors.get(bindings)
        if color is None:
            read = (self.material(path, time).material.color_primvar for path in bindings.candidates)
            color = next((name for name in read if name), "")
            if all(path in self._materials for path in bindings.candidates):
                self._colors[bindings] = color
        return color

    def material(self, path: Sdf.Path, time: Usd.TimeCode) -> ReadMaterial:
        """The material at a path; read once where it does not change over time."""
        if path in self._materials:
            return self._materials[path]
        try:
            read = self._read_material(path, time)
        except Exception as error:  # a bug goes on as one
            reason = blamed(error, self.stage.GetPrimAtPath(path.GetPrimPath()))
            read = not_understood(self.shown(path), reason)
        if not read.time_varying:
            self._materials[path] = read
        return read

    def _read_material(self, path: Sdf.Path, time: Usd.TimeCode) -> ReadMaterial:
        if path.IsPropertyPath():
            return draw_mode.read_material(self.stage, path, self.shown(path))
        return read_material(self.stage, path, self.shown(path), time, occlusion=self._extras.occlusion)

    def bindings(self, path: Sdf.Path | str) -> Bindings:
        """Relationships do not vary over time."""
        return self._bound(str(path)).bindings

    def binds_by_collection(self, path: Sdf.Path) -> bool:
        """Does a prim, or one above it, bind what a collection holds?"""
        return self._bound(str(path)).by_collection

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

    def shown(self, path: Sdf.Path | str) -> str:
        """The path by which users know a prim: for one inside a native prototype, its path in the first instance."""
        if not self._first_instances:
            return str(path)
        root, slash, below = str(path)[1:].partition("/")
        return self._first_instances.get(root, f"/{root}") + slash + below

    def name_prototype(self, prototype: Usd.Prim, instance: Usd.Prim) -> str:
        """Show what stands in `prototype` as part of `instance`, or of the instance that came first."""
        return self._first_instances.setdefault(prototype.GetName(), self.shown(instance.GetPath()))

    def _is_time_varying(self, prim: Usd.Prim, said: Said) -> bool:
        """Asked only when a second frame is read."""
        if said.path not in self._time_varying:
            color = self._color_of(prim, said, material_subsets(prim), Usd.TimeCode.Default())
            self._time_varying[said.path] = is_time_varying(prim, color, self._extras.primvars, said)
        return self._time_varying[said.path]

    def _as_shown(self, surface: Surface) -> Surface:
        shown = self.shown(surface.path)
        if shown == surface.path:
            return surface
        issues = tuple(replace(issue, path=shown) for issue in surface.issues)
        return replace(surface, path=shown, issues=issues)
