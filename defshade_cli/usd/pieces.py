"""Prims as pieces: what each is by itself, whatever stands below it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from heapq import merge
from operator import itemgetter
from typing import TYPE_CHECKING, NamedTuple, cast

from pxr import Usd, UsdLux

from defshade_cli.scene.light import Light
from defshade_cli.scene.scene import Unsupported
from defshade_cli.usd.blame import blamed
from defshade_cli.usd.gprims.copies import Copies, once
from defshade_cli.usd.instancing.instancing import Piece, Standing
from defshade_cli.usd.kind import Kind
from defshade_cli.usd.lights.light import is_light, read_light
from defshade_cli.usd.lights.mesh_light import Glow
from defshade_cli.usd.materials.bindings import Bindings, bound_to
from defshade_cli.usd.memory import Memory
from defshade_cli.usd.models.draw_mode import FULL
from defshade_cli.usd.said import Said
from defshade_cli.usd.surfaces.geometry import Surface
from defshade_cli.usd.surfaces.varying import is_time_varying
from defshade_cli.usd.xform import gf_matrix, matrix

if TYPE_CHECKING:
    from defshade_cli.usd.skel import Rig

_JOINTS = "primvars:skel:jointIndices"


class Awaited(NamedTuple):
    """In place of a piece: a mesh that is looked into with others. place: of what may be to say among issues."""

    prim: Usd.Prim
    said: Said
    here: Standing
    place: int


class Found:
    """What is met beside pieces.

    issues: what is left out, as the keys of a dictionary to keep their order.
    dormant: something is absent now, but not at all times.
    glows: what makes surfaces lights, by their paths.  portals: paths of the hints for sampling domes.
    """

    def __init__(self, memory: Memory) -> None:
        self._memory = memory
        self.issues: dict[Unsupported, None] = {}
        self.dormant = False
        self.glows: dict[str, Glow] = {}
        self.portals: list[str] = []

    def report(self, prim: Usd.Prim, *reasons: str) -> None:
        """Why something of a prim is left out."""
        path = self._memory.names.shown(prim.GetPath())
        self.issues.update(dict.fromkeys(Unsupported(path, reason) for reason in reasons))


class PieceReader:
    """Of one time. base: the frame that it is of; other than `time` while a shutter is open.

    found: takes what is to say.
    """

    def __init__(
        self, memory: Memory, time: Usd.TimeCode, base: Usd.TimeCode, purposes: Sequence[str], found: Found
    ) -> None:
        self._memory, self._purposes, self._found = memory, purposes, found
        self._time, self._base, self._is_at_frame = time, base, time == base

    def own_pieces(self, prim: Usd.Prim, kind: Kind, here: Standing, said: Said) -> list[Piece | Awaited]:
        """What the prim itself is, whatever stands below it: a light, a surface, both or neither."""
        found: list[Piece | Awaited | None] = []
        if is_light(said.schemas):
            found.append(self._light(prim, here))
        if kind is Kind.GPRIM and self._is_asked_for(here):
            found.append(self._gprim(prim, here, said))
        elif kind is Kind.UNDRAWN:
            self._found.report(prim, f"prims of type {prim.GetTypeName()} are not drawn")
        elif kind is Kind.UNKNOWN:
            self._found.report(prim, f"no schema defines the type {prim.GetTypeName()}")
        return [piece for piece in found if piece]

    def _light(self, prim: Usd.Prim, here: Standing) -> Piece | None:
        """A light with a shape of its own; portals and surfaces that glow are noted."""
        path = self._memory.names.shown(prim.GetPath())
        if prim.IsA(UsdLux.PortalLight):
            self._found.portals.append(path)
            return None
        light, issues = read_light(prim, self._time)
        self._found.report(prim, *(issue.reason for issue in issues))
        if isinstance(light, Glow):
            self._found.glows[light.surface or path] = light
            return None
        return None if light is None else self._piece(prim, here, light)

    def _gprim(self, prim: Usd.Prim, here: Standing, said: Said) -> Piece | Awaited | None:
        if here.rig and _JOINTS in said.names:
            self._check_joints(prim, here)
        if self._is_at_frame and self._memory.is_unknown_mesh(said):
            return Awaited(prim, said, here, len(self._found.issues))
        surface = self._memory.surface_around(prim, self._time, self._base, said)
        if surface is None:
            self._found.report(prim, f"prims of type {prim.GetTypeName()} are not drawn")
            return None
        piece, issues = self._standing_piece(prim, here, surface, said)
        self._found.issues.update(dict.fromkeys(issues))
        return piece

    def stand_in(self, prim: Usd.Prim, here: Standing) -> list[Piece]:
        """What is drawn in place of a model, if its purpose is drawn."""
        if not self._is_asked_for(here):
            return []
        surface = self._memory.stand_in(prim, here.draw_mode or FULL)
        self._found.issues.update(dict.fromkeys(surface.issues))
        return [self._piece(prim, here, surface, {path: bound_to(path) for path in surface.groups})]

    def _is_asked_for(self, here: Standing) -> bool:
        """Inside a prototype only its instances may tell."""
        return here.purpose in (None, *self._purposes)

    def arrived(self, pieces: Sequence[Piece | Awaited]) -> list[Piece]:
        """The pieces with those that were awaited, whose surfaces are looked into together."""
        awaited = [piece for piece in pieces if isinstance(piece, Awaited)]
        if not awaited:
            return cast("list[Piece]", pieces)
        prims, saids = [piece.prim for piece in awaited], [piece.said for piece in awaited]
        surfaces = iter(self._memory.new_surfaces(prims, saids, self._time))
        late: list[tuple[int, Unsupported]] = []
        arrived = (self._arrive(p, next(surfaces), late) if isinstance(p, Awaited) else p for p in pieces)
        found = [piece for piece in arrived if piece]
        if late:
            said = merge(late, enumerate(self._found.issues), key=itemgetter(0))
            self._found.issues = dict.fromkeys(issue for _, issue in said)
        return found

    def _arrive(
        self, awaited: Awaited, surface: Surface | Exception, late: list[tuple[int, Unsupported]]
    ) -> Piece | None:
        """late: takes what is to say of it, with the place among the issues that it would have had."""
        prim, said, here, place = awaited
        try:
            if isinstance(surface, Exception):
                raise surface
            piece, issues = self._standing_piece(prim, here, surface, said)
        except Exception as error:  # a bug goes on as one
            late.append((place, Unsupported(self._memory.names.shown(prim.GetPath()), blamed(error, prim))))
            return None
        late.extend([(place, issue) for issue in issues])
        return piece

    def _standing_piece(
        self, prim: Usd.Prim, here: Standing, surface: Surface, said: Said
    ) -> tuple[Piece, tuple[Unsupported, ...]]:
        """The surface where it is drawn, and what is to say of it."""
        if surface.groups and here.rig:
            surface, here = self._deformed(prim, surface, here, here.rig)
        self._found.dormant |= not surface.groups and is_time_varying(prim, said=said)
        bindings = {path: self._memory.materials.bindings(path) for path in surface.groups}
        return self._piece(prim, here, surface, bindings), surface.issues

    def _check_joints(self, prim: Usd.Prim, here: Standing) -> None:
        from defshade_cli.usd.skel import why_unbent

        if reason := why_unbent(here.on_stage(prim)):
            self._found.report(prim, f"drawn in its rest shape: {reason}")

    def _deformed(self, prim: Usd.Prim, rest: Surface, here: Standing, rig: Rig) -> tuple[Surface, Standing]:
        """The surface as its skeleton bends it, standing where that does."""
        deformer = self._memory.rigs.deformer(rig, here.on_stage(prim))
        if deformer is None:
            return rest, here
        surface, skeleton_from_surface = deformer.at(rest, self._time)
        if skeleton_from_surface is None:
            return surface, here
        root_from_skeleton, in_world = rig.place(deformer.skeleton, self._memory.xforms)
        return surface, here._replace(
            root_from_prim=gf_matrix(skeleton_from_surface) * root_from_skeleton, in_world=in_world
        )

    def _piece(
        self, prim: Usd.Prim, here: Standing, content: Surface | Light, bindings: Mapping[str, Bindings] | None = None
    ) -> Piece:
        copies = _copies_of(content)
        placed = matrix(here.root_from_prim)
        return Piece(
            content,
            placed[None] if len(copies.ids) == 1 and copies.ids[0] < 0 else placed @ copies.object_from_copy,
            (content.path if isinstance(content, Surface) else self._memory.names.shown(prim.GetPath()),),
            copies.ids,
            copies.display_color,
            copies.display_opacity,
            here.purpose,
            bindings or {},
            here.in_world,
        )


def _copies_of(content: Surface | Light) -> Copies:
    """Where a surface places itself; most do so once, with the colour of all of it."""
    if not isinstance(content, Surface):
        return once()
    return content.copies or once(content.display_color, content.display_opacity)
