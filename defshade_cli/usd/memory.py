"""What stays the same from frame to frame, read once."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from pxr import Sdf, Usd, UsdGeom

from defshade_cli.scene.extras import NO_EXTRAS, Extras
from defshade_cli.scene.texture import SeenFrom
from defshade_cli.usd.kind import Kinds
from defshade_cli.usd.materials.materials import Materials
from defshade_cli.usd.models import draw_mode
from defshade_cli.usd.names import Names
from defshade_cli.usd.opening.stage import has_clips
from defshade_cli.usd.polygons.checked import check_all
from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.polygons.positions import is_carried_by_velocities
from defshade_cli.usd.polygons.shapes import Shapes
from defshade_cli.usd.polygons.subsets import material_subsets
from defshade_cli.usd.polygons.told import Told, told_of
from defshade_cli.usd.said import Said
from defshade_cli.usd.sharing import shared
from defshade_cli.usd.surfaces.geometry import Surface, move_surface, read_surface, surface_of
from defshade_cli.usd.surfaces.shape import Shape
from defshade_cli.usd.surfaces.varying import is_time_varying, only_points_vary

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
    """The unchanging parts of one stage: its surfaces here, and what they are made of and called.

    seen_from: for cards placed by their textures.
    as_cages: what is round is what Hydra draws of it: see gprims.read_solid, and facing.
    kinds: of prims.  clipped: see stage.has_clips.  instanced: are there native instances?
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
        self.names = Names()
        self.materials = Materials(stage, self.names, occlusion=extras.occlusion)
        self._extras, self._as_cages = extras, as_cages
        self._shapes = Shapes()
        self._surfaces: dict[Hashable, tuple[Usd.TimeCode, Surface | None]] = {}
        self._time_varying: dict[Hashable, bool] = {}
        self._models = draw_mode.StandIns(seen_from)
        self._stand_ins: dict[tuple[Sdf.Path, str], Surface] = {}

    @property
    def shown(self) -> tuple[str, ...]:
        """Primvars that layers show."""
        return self._extras.primvars

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
        time_read, known = self._surfaces.get(said.key, (None, None))
        if time_read is not None and (time == time_read or not self._is_time_varying(prim, said)):
            return known
        surface = self._at_another_time(known, prim, time, said) if known else self._read_surface(prim, time, said)
        self._surfaces[said.key] = time, surface
        return surface

    def is_unknown_mesh(self, said: Said) -> bool:
        """Is it one to be asked with others?"""
        return said.type_name == "Mesh" and not self._extras.primvars and said.key not in self._surfaces

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
        told = told_of(said, time, self.materials.color_of(prim, said, subsets, time))
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
        self._surfaces[said.key] = time, surface
        return surface

    def _at_another_time(self, known: Surface, prim: Usd.Prim, time: Usd.TimeCode, said: Said) -> Surface | None:
        """Read is no more than varies; what turns out to be equal stays the same object."""
        shown = self.materials.color_of(prim, said, material_subsets(prim), time), self._extras.primvars
        moved = move_surface(known, prim, time) if known.groups and only_points_vary(prim, *shown, said) else None
        return shared(moved or self._read_surface(prim, time, said), known)

    def _read_surface(self, prim: Usd.Prim, time: Usd.TimeCode, said: Said) -> Surface | None:
        subsets = material_subsets(prim)
        surface = read_surface(
            prim,
            time,
            self.materials.color_of(prim, said, subsets, time),
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

    def _is_time_varying(self, prim: Usd.Prim, said: Said) -> bool:
        """Asked only when a second frame is read."""
        if said.key not in self._time_varying:
            color = self.materials.color_of(prim, said, material_subsets(prim), Usd.TimeCode.Default())
            self._time_varying[said.key] = is_time_varying(prim, color, self._extras.primvars, said)
        return self._time_varying[said.key]

    def _as_shown(self, surface: Surface) -> Surface:
        shown = self.names.shown(surface.path)
        if shown == surface.path:
            return surface
        issues = tuple(replace(issue, path=shown) for issue in surface.issues)
        return replace(surface, path=shown, issues=issues)
