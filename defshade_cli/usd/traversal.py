"""The walk over a stage: from prims to pieces.

Drawn is what UsdImaging would draw: active, loaded, defined and visible prims. Inheritance of visibility and purpose,
reset xform stacks and instances are resolved on the way down; bindings and primvars by USD at the prim itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from heapq import merge
from operator import itemgetter
from typing import TYPE_CHECKING, NamedTuple, cast

from pxr import Sdf, Usd, UsdGeom, UsdLux

from defshade_cli.scene.light import Light
from defshade_cli.scene.scene import Unsupported
from defshade_cli.usd.blame import blamed
from defshade_cli.usd.gprims.copies import Copies, once
from defshade_cli.usd.instancing.instancing import Piece, Standing, finite, place
from defshade_cli.usd.instancing.native_instances import NativeInstances
from defshade_cli.usd.kind import Kind, Nature
from defshade_cli.usd.lights.light import is_light, read_light
from defshade_cli.usd.lights.mesh_light import Glow
from defshade_cli.usd.materials.binding import Bindings, bound_to
from defshade_cli.usd.memory import Memory
from defshade_cli.usd.models.draw_mode import FULL, handed_down, mode_above, takes_effect
from defshade_cli.usd.render_settings.render_pass import PassRules
from defshade_cli.usd.said import Inherited, Said, said_of
from defshade_cli.usd.surfaces.geometry import Surface, is_time_varying
from defshade_cli.usd.values import STANDS_NOWHERE
from defshade_cli.usd.xform import IDENTITY, gf_matrix, matrix

if TYPE_CHECKING:
    from defshade_cli.usd.skel import Rig

_VISIBILITY, _PURPOSE = str(UsdGeom.Tokens.visibility), str(UsdGeom.Tokens.purpose)
_JOINTS = "primvars:skel:jointIndices"
_XFORM_OPS = str(UsdGeom.Tokens.xformOpOrder)

_PROTOTYPE_CHILDREN = Usd.PrimIsActive & Usd.PrimIsLoaded
"""Classes and overs count below a PointInstancer's prototype: the schema recommends them to hide it elsewhere."""


class _Awaited(NamedTuple):
    """In place of a piece: a mesh that is looked into with others. place: of what may be to say among issues."""

    prim: Usd.Prim
    said: Said
    here: Standing
    place: int


class Traversal:
    """One walk at one time, in which each prototype is read once.

    rules: of a RenderPass.  base: the frame that the time is of; other than `time` while a shutter is open.
    issues: what is left out, as the keys of a dictionary to keep their order.
    dormant: something is absent now, but not at all times.
    glows: what makes surfaces lights, by their paths.  portals: paths of the hints for sampling domes.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        memory: Memory,
        time: Usd.TimeCode,
        purposes: Sequence[str],
        base: Usd.TimeCode,
        rules: PassRules | None = None,
    ) -> None:
        self.issues: dict[Unsupported, None] = {}
        self.dormant = False
        self.glows: dict[str, Glow] = {}
        self.portals: list[str] = []
        self._stage, self._memory, self._purposes = stage, memory, purposes
        self._time, self._base, self._rules = time, base, rules
        self._is_at_frame = time == base
        self._prototypes: dict[tuple[Sdf.Path, Sdf.Path | None], tuple[Piece, ...] | None] = {}
        memory.xforms.SetTime(time)

    def read_stage(self) -> tuple[Piece, ...]:
        """All that is drawn of the stage; what stands nowhere is reported."""
        pieces, lost = finite(self._read(self._stage.GetPseudoRoot().GetChildren(), Standing(draw_mode=FULL)))
        self.issues.update(dict.fromkeys(Unsupported(path, STANDS_NOWHERE) for path in lost))
        return pieces

    def _read(
        self, roots: Iterable[Usd.Prim], above: Standing, predicate: object = Usd.PrimDefaultPredicate
    ) -> tuple[Piece, ...]:
        """The pieces of the subtree that starts with `roots`."""
        pieces: list[Piece | _Awaited] = []
        instances = NativeInstances(self._memory)
        stack = [(root, above) for root in reversed(list(roots))]
        while stack:
            prim, above = stack.pop()
            try:
                children, here = self._visit(prim, above, predicate, pieces, instances)
            except Exception as error:  # a bug goes on as one
                self._report(prim, blamed(error, prim))
                continue
            if children:
                stack.extend([(child, here) for child in reversed(children)])
        arrived = self._arrived(pieces)
        return (*arrived, *self._native_instances(instances))

    def _visit(
        self,
        prim: Usd.Prim,
        above: Standing,
        predicate: object,
        pieces: list[Piece | _Awaited],
        instances: NativeInstances,
    ) -> tuple[Sequence[Usd.Prim], Standing]:
        """Put the prim with `pieces` or `instances`. Returns the children to visit, and what they stand in."""
        nature = self._memory.kinds.of(prim)
        kind = nature.kind
        if kind is Kind.SHADING or self._is_pruned(prim):
            return (), above
        is_surface = kind is Kind.GPRIM
        said = said_of(prim, nature.type_name, above.primvars, is_surface=is_surface, clipped=self._memory.clipped)
        here = self._stand(prim, above, nature, said)
        if here is None:
            return (), above
        if here.draw_mode not in (None, FULL) and takes_effect(prim):
            pieces.append(self._stand_in(prim, here))
            return (), here
        pieces += self._own_pieces(prim, kind, here, said)
        is_instance = self._memory.instanced and prim.IsInstance()
        if self._is_hidden(prim) and (kind is Kind.POINT_INSTANCER or is_instance):
            return (), here
        if kind is Kind.POINT_INSTANCER:
            pieces.extend(self._point_instances(prim, here))
            return (), here
        if is_instance and not _is_rigged_from_above(prim, here):
            instances.add(prim, here)
            return (), here
        if said.is_leaf and not is_instance:
            return (), here
        chosen = Usd.TraverseInstanceProxies(predicate) if here.rig else predicate
        below = here._replace(primvars=Inherited(prim)) if said.own_primvars else here
        return prim.GetFilteredChildren(chosen), below

    def _stand(self, prim: Usd.Prim, above: Standing, nature: Nature, said: Said) -> Standing | None:
        """What `prim` hands down, None where it is invisible; of other than Imageables only the draw mode counts."""
        mode = handed_down(prim, above.draw_mode) if above.draw_mode else None
        if not nature.is_imageable:
            return above._replace(draw_mode=mode)
        if _VISIBILITY in said.names and not self._is_visible(prim):
            return None
        root_from_prim, in_world, purpose, _, rig, proxied, primvars = above
        if _XFORM_OPS in said.names:
            local, resets = self._memory.xforms.GetLocalTransformation(prim)
            in_world |= resets
            root_from_prim = local if resets or root_from_prim is IDENTITY else local * root_from_prim
        if _PURPOSE in said.names:
            authored = prim.GetAttribute(_PURPOSE)
            purpose = str(authored.Get()) if authored.HasAuthoredValue() else purpose
        here = Standing(root_from_prim, in_world, purpose, mode, rig, proxied, primvars)
        return here.with_rig(prim) if nature.is_skel_root else here

    def _is_hidden(self, prim: Usd.Prim) -> bool:
        """Itself, by the pass; what stands below it may be shown."""
        return self._rules is not None and not self._rules.shows(prim.GetPath())

    def _is_pruned(self, prim: Usd.Prim) -> bool:
        return self._rules is not None and self._rules.prunes(prim.GetPath())

    def _is_visible(self, prim: Usd.Prim) -> bool:
        visibility = prim.GetAttribute(_VISIBILITY)
        if visibility.Get(self._time) != UsdGeom.Tokens.invisible:
            return True
        self.dormant |= visibility.ValueMightBeTimeVarying()
        return False

    def _own_pieces(self, prim: Usd.Prim, kind: Kind, here: Standing, said: Said) -> list[Piece | _Awaited]:
        """What the prim itself is, whatever stands below it: a light, a surface, both or neither."""
        found: list[Piece | _Awaited | None] = []
        if self._is_hidden(prim):
            return []
        if is_light(said.schemas):
            found.append(self._light(prim, here))
        if kind is Kind.GPRIM and here.purpose in (None, *self._purposes):
            found.append(self._gprim(prim, here, said))
        elif kind is Kind.UNDRAWN:
            self._report(prim, f"prims of type {prim.GetTypeName()} are not drawn")
        elif kind is Kind.UNKNOWN:
            self._report(prim, f"no schema defines the type {prim.GetTypeName()}")
        return [piece for piece in found if piece]

    def _stand_in(self, prim: Usd.Prim, here: Standing) -> Piece:
        """What is drawn in place of a model."""
        surface = self._memory.stand_in(prim, here.draw_mode or FULL)
        self.issues.update(dict.fromkeys(surface.issues))
        return self._piece(prim, here, surface, {path: bound_to(path) for path in surface.groups})

    def _light(self, prim: Usd.Prim, here: Standing) -> Piece | None:
        """A light with a shape of its own; portals and surfaces that glow are noted."""
        path = self._memory.shown(prim.GetPath())
        if prim.IsA(UsdLux.PortalLight):
            self.portals.append(path)
            return None
        light, issues = read_light(prim, self._time)
        self._report(prim, *(issue.reason for issue in issues))
        if isinstance(light, Glow):
            self.glows[light.surface or path] = light
            return None
        return None if light is None else self._piece(prim, here, light)

    def _gprim(self, prim: Usd.Prim, here: Standing, said: Said) -> Piece | _Awaited | None:
        if here.rig and _JOINTS in said.names:
            self._check_joints(prim, here)
        if self._is_at_frame and self._memory.is_unknown_mesh(said):
            return _Awaited(prim, said, here, len(self.issues))
        surface = self._memory.surface_around(prim, self._time, self._base, said)
        if surface is None:
            self._report(prim, f"prims of type {prim.GetTypeName()} are not drawn")
            return None
        piece, issues = self._standing_piece(prim, here, surface)
        self.issues.update(dict.fromkeys(issues))
        return piece

    def _check_joints(self, prim: Usd.Prim, here: Standing) -> None:
        from defshade_cli.usd.skel import why_unbent

        if reason := why_unbent(here.on_stage(prim)):
            self._report(prim, f"drawn in its rest shape: {reason}")

    def _standing_piece(
        self, prim: Usd.Prim, here: Standing, surface: Surface
    ) -> tuple[Piece, tuple[Unsupported, ...]]:
        """The surface where it is drawn, and what is to say of it."""
        if surface.groups and here.rig:
            surface, here = self._deformed(prim, surface, here, here.rig)
        self.dormant |= not surface.groups and is_time_varying(prim)
        bindings = {path: self._memory.bindings(path) for path in surface.groups}
        return self._piece(prim, here, surface, bindings), surface.issues

    def _arrived(self, pieces: Sequence[Piece | _Awaited]) -> list[Piece]:
        """The pieces with those that were awaited, whose surfaces are looked into together."""
        awaited = [piece for piece in pieces if isinstance(piece, _Awaited)]
        if not awaited:
            return cast("list[Piece]", pieces)
        prims, saids = [piece.prim for piece in awaited], [piece.said for piece in awaited]
        surfaces = iter(self._memory.new_surfaces(prims, saids, self._time))
        late: list[tuple[int, Unsupported]] = []
        arrived = (self._arrive(p, next(surfaces), late) if isinstance(p, _Awaited) else p for p in pieces)
        found = [piece for piece in arrived if piece]
        if late:
            said = merge(late, enumerate(self.issues), key=itemgetter(0))
            self.issues = dict.fromkeys(issue for _, issue in said)
        return found

    def _arrive(
        self, awaited: _Awaited, surface: Surface | Exception, late: list[tuple[int, Unsupported]]
    ) -> Piece | None:
        """late: takes what is to say of it, with the place among the issues that it would have had."""
        prim, _, here, place = awaited
        try:
            if isinstance(surface, Exception):
                raise surface
            piece, issues = self._standing_piece(prim, here, surface)
        except Exception as error:  # a bug goes on as one
            late.append((place, Unsupported(self._memory.shown(prim.GetPath()), blamed(error, prim))))
            return None
        late.extend([(place, issue) for issue in issues])
        return piece

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
            (content.path if isinstance(content, Surface) else self._memory.shown(prim.GetPath()),),
            copies.ids,
            copies.display_color,
            copies.display_opacity,
            here.purpose,
            bindings or {},
            here.in_world,
        )

    def _native_instances(self, instances: NativeInstances) -> Iterator[Piece]:
        for sharing, first, placement in instances.placements(self._time):
            key = sharing.prototype, sharing.animation
            if key not in self._prototypes:
                children = first.prim.GetPrototype().GetChildren()
                self._prototypes[key] = self._read(children, first.here.inside(first.prim))
            yield from place(self._prototypes[key] or (), placement)
        for prim, reasons in instances.issues.items():
            self._report(prim, *reasons)

    def _point_instances(self, prim: Usd.Prim, here: Standing) -> Iterator[Piece]:
        from defshade_cli.usd.instancing.point_instancer import has_varying_copies, read_point_instancer

        swarm = read_point_instancer(prim, self._time, self._base)
        self._report(prim, *swarm.issues)
        self.dormant |= not swarm.placements and has_varying_copies(prim)
        for path, placement in swarm.placements:
            placed = replace(
                placement,
                root_from_copy=matrix(here.root_from_prim) @ placement.root_from_copy,
                purpose=here.purpose,
                bindings=self._memory.bindings(prim.GetPath()),
                in_world=here.in_world,
            )
            yield from place(self._point_prototype(path, prim, here), placed)

    def _point_prototype(self, path: Sdf.Path, instancer: Usd.Prim, here: Standing) -> tuple[Piece, ...]:
        """A prototype's subtree with its root's own transform; of what stands above it only the purpose counts."""
        key = path, None
        if key not in self._prototypes:
            root = self._stage.GetPrimAtPath(path)
            if not root or not root.IsActive():
                self._report(instancer, f"there is no prototype {self._memory.shown(path)}")
                return ()
            self._prototypes[key] = None
            above = UsdGeom.Imageable(root.GetParent()).ComputePurposeInfo()
            purpose = str(above.purpose) if above.isInheritable else None
            primvars = Inherited(root.GetParent())
            standing = Standing(IDENTITY, False, purpose, mode_above(root), None, here.proxied, primvars)
            self._prototypes[key] = self._read([root], standing, _PROTOTYPE_CHILDREN)
        pieces = self._prototypes[key]
        if pieces is None:
            self._report(instancer, "it is part of its own prototype")
        return pieces or ()

    def _report(self, prim: Usd.Prim, *reasons: str) -> None:
        path = self._memory.shown(prim.GetPath())
        self.issues.update(dict.fromkeys(Unsupported(path, reason) for reason in reasons))


def _copies_of(content: Surface | Light) -> Copies:
    """Where a surface places itself; most do so once, with the colour of all of it."""
    if not isinstance(content, Surface):
        return once()
    return content.copies or once(content.display_color, content.display_opacity)


def _is_rigged_from_above(instance: Usd.Prim, here: Standing) -> bool:
    """Is a SkelRoot above the instance? Its skeletons may deform each instance otherwise."""
    return here.rig is not None and here.rig.root != here.on_stage(instance)
