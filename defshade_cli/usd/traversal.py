"""The walk over a stage: from prims to pieces.

Drawn is what UsdImaging would draw: active, loaded, defined and visible prims. Inheritance of visibility and purpose,
reset xform stacks and instances are resolved on the way down; bindings and primvars by USD at the prim itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain

from pxr import Sdf, Usd, UsdGeom

from defshade_cli.scene.scene import Unsupported
from defshade_cli.usd.blame import blamed
from defshade_cli.usd.instancing.instancing import Piece, Placement, Standing, finite, place
from defshade_cli.usd.instancing.native_instances import NativeInstances, rebound
from defshade_cli.usd.kind import Kind, Nature
from defshade_cli.usd.materials.bindings import Bindings
from defshade_cli.usd.memory import Memory
from defshade_cli.usd.models.draw_mode import FULL, handed_down, mode_above, takes_effect
from defshade_cli.usd.pieces import Awaited, Found, PieceReader
from defshade_cli.usd.render_settings.render_pass import PassRules
from defshade_cli.usd.said import Inherited, Said, said_of
from defshade_cli.usd.values import STANDS_NOWHERE
from defshade_cli.usd.xform import IDENTITY, matrix

_VISIBILITY, _PURPOSE = str(UsdGeom.Tokens.visibility), str(UsdGeom.Tokens.purpose)
_XFORM_OPS = str(UsdGeom.Tokens.xformOpOrder)

_PROTOTYPE_CHILDREN = Usd.PrimIsActive & Usd.PrimIsLoaded
"""Classes and overs count below a PointInstancer's prototype: the schema recommends them to hide it elsewhere."""


class Traversal:
    """One walk at one time, in which each prototype is read once.

    rules: of a RenderPass.  base: the frame that the time is of; other than `time` while a shutter is open.
    found: what is met beside pieces.
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
        self.found = Found(memory)
        self._reader = PieceReader(memory, time, base, purposes, self.found)
        self._stage, self._memory, self._rules = stage, memory, rules
        self._time, self._base = time, base
        self._prototypes: dict[tuple[Sdf.Path, Sdf.Path | None, Bindings], tuple[Piece, ...] | None] = {}
        memory.xforms.SetTime(time)

    def read_stage(self) -> tuple[Piece, ...]:
        """All that is drawn of the stage; what stands nowhere is reported."""
        pieces, lost = finite(self._read(self._stage.GetPseudoRoot().GetChildren(), Standing(draw_mode=FULL)))
        self.found.issues.update(dict.fromkeys(Unsupported(path, STANDS_NOWHERE) for path in lost))
        return pieces

    def _read(
        self, roots: Iterable[Usd.Prim], above: Standing, predicate: object = Usd.PrimDefaultPredicate
    ) -> tuple[Piece, ...]:
        """The pieces of the subtree that starts with `roots`."""
        pieces: list[Piece | Awaited] = []
        instances = NativeInstances(self._memory)
        stack = [(root, above) for root in reversed(list(roots))]
        while stack:
            prim, above = stack.pop()
            try:
                children, here = self._visit(prim, above, predicate, pieces, instances)
            except Exception as error:  # a bug goes on as one
                self.found.report(prim, blamed(error, prim))
                continue
            if children:
                stack.extend([(child, here) for child in reversed(children)])
        arrived = self._reader.arrived(pieces)
        return (*arrived, *self._native_instances(instances))

    def _visit(
        self,
        prim: Usd.Prim,
        above: Standing,
        predicate: object,
        pieces: list[Piece | Awaited],
        instances: NativeInstances,
    ) -> tuple[Sequence[Usd.Prim], Standing]:
        """Put the prim with `pieces` or `instances`. Returns the children to visit, and what they stand in."""
        nature = self._memory.kinds.of(prim)
        kind = nature.kind
        if kind is Kind.SHADING or self._is_pruned(prim):
            return (), above
        is_surface = kind is Kind.GPRIM
        clipped, outer = self._memory.clipped, above.outer
        said = said_of(prim, nature.type_name, above.primvars, is_surface=is_surface, clipped=clipped, outer=outer)
        here = self._stand(prim, above, nature, said)
        if here is None:
            return (), above
        if here.draw_mode not in (None, FULL) and takes_effect(prim):
            if not self._is_hidden(prim):
                pieces.extend(self._reader.stand_in(prim, here))
            return (), here
        is_hidden = self._is_hidden(prim)
        if not is_hidden:
            pieces += self._reader.own_pieces(prim, kind, here, said)
        is_instance = self._memory.instanced and prim.IsInstance()
        if is_hidden and (kind is Kind.POINT_INSTANCER or is_instance):
            return (), here
        if kind is Kind.POINT_INSTANCER:
            pieces.extend(self._point_instances(prim, here))
            return (), here
        if is_instance and not _is_rigged_from_above(prim, here):
            instances.add(prim, here)
            if self._memory.shown:
                self._tell_of_unshown(prim)
            return (), here
        if said.is_leaf and not is_instance:
            return (), here
        chosen = Usd.TraverseInstanceProxies(predicate) if here.rig else predicate
        below = here._replace(primvars=Inherited(prim)) if said.own_primvars else here
        return prim.GetFilteredChildren(chosen), below

    def _tell_of_unshown(self, instance: Usd.Prim) -> None:
        """A layer shows what prims have inside their prototype, and not what their instances hand down."""
        api = UsdGeom.PrimvarsAPI(instance)
        primvars = {name: api.FindPrimvarWithInheritance(name) for name in self._memory.shown}
        found = [name for name, primvar in primvars.items() if primvar and primvar.HasValue()]
        self.found.report(instance, *(f"primvars:{name} is not shown of what is inside the instance" for name in found))

    def _stand(self, prim: Usd.Prim, above: Standing, nature: Nature, said: Said) -> Standing | None:
        """What `prim` hands down, None where it is invisible; of other than Imageables only the draw mode counts."""
        mode = handed_down(prim, above.draw_mode) if above.draw_mode else None
        if not nature.is_imageable:
            return above._replace(draw_mode=mode)
        if _VISIBILITY in said.names and not self._is_visible(prim):
            return None
        root_from_prim, in_world, purpose, _, rig, proxied, primvars, outer = above
        if _XFORM_OPS in said.names:
            local, resets = self._memory.xforms.GetLocalTransformation(prim)
            in_world |= resets
            root_from_prim = local if resets or root_from_prim is IDENTITY else local * root_from_prim
        if _PURPOSE in said.names:
            authored = prim.GetAttribute(_PURPOSE)
            purpose = str(authored.Get()) if authored.HasAuthoredValue() else purpose
        here = Standing(root_from_prim, in_world, purpose, mode, rig, proxied, primvars, outer)
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
        self.found.dormant |= visibility.ValueMightBeTimeVarying()
        return False

    def _native_instances(self, instances: NativeInstances) -> Iterator[Piece]:
        for sharing, first, placement in instances.placements(self._time):
            outer = self._memory.materials.outer(sharing.bindings.under(first.here.outer), self._time)
            key = sharing.prototype, sharing.animation, outer
            if key not in self._prototypes:
                children = first.prim.GetPrototype().GetChildren()
                self._prototypes[key] = self._read(children, first.here.inside(first.prim, outer))
            placed = self._placed(self._prototypes[key] or (), placement, first.here.outer)
            if sharing.by_collection:
                placed = chain.from_iterable(rebound(piece, self._memory, first.prim) for piece in placed)
            yield from placed
        for prim, reasons in instances.issues.items():
            self.found.report(prim, *reasons)

    def _point_instances(self, prim: Usd.Prim, here: Standing) -> Iterator[Piece]:
        from defshade_cli.usd.instancing.point_instancer import has_varying_copies, read_point_instancer

        swarm = read_point_instancer(prim, self._time, self._base)
        self.found.dormant |= not swarm.placements and has_varying_copies(prim)
        bindings = self._memory.materials.bindings(prim.GetPath())
        outer = self._memory.materials.outer(bindings.under(here.outer), self._time)
        for path, placement in swarm.placements:
            placed = replace(
                placement,
                root_from_copy=matrix(here.root_from_prim) @ placement.root_from_copy,
                purpose=here.purpose,
                bindings=bindings,
                in_world=here.in_world,
            )
            yield from self._placed(self._point_prototype(path, prim, here, outer), placed, here.outer)
        self.found.report(prim, *swarm.issues)

    def _placed(self, pieces: Iterable[Piece], placement: Placement, outer: Bindings) -> Iterator[Piece]:
        """Each with the colours of the primvar that its materials read. outer: of where it is placed."""
        above = placement.bindings.under(outer)
        for piece in pieces:
            bound = [bindings.under(above) for bindings in piece.bindings.values()]
            color = self._memory.materials.color_by(bound, self._time)
            yield from place([piece], placement.colored_by(color))

    def _point_prototype(
        self, path: Sdf.Path, instancer: Usd.Prim, here: Standing, outer: Bindings
    ) -> tuple[Piece, ...]:
        """A prototype's subtree with its root's own transform; of what stands above it only the purpose counts."""
        key = path, None, outer
        if key not in self._prototypes:
            root = self._stage.GetPrimAtPath(path)
            if not root or not root.IsActive():
                self.found.report(instancer, f"there is no prototype {self._memory.names.shown(path)}")
                return ()
            self._prototypes[key] = None
            above = UsdGeom.Imageable(root.GetParent()).ComputePurposeInfo()
            purpose = str(above.purpose) if above.isInheritable else None
            primvars = Inherited(root.GetParent())
            standing = Standing(IDENTITY, False, purpose, mode_above(root), None, here.proxied, primvars, outer)
            self._prototypes[key] = self._read([root], standing, _PROTOTYPE_CHILDREN)
        pieces = self._prototypes[key]
        if pieces is None:
            self.found.report(instancer, "it is part of its own prototype")
        return pieces or ()


def _is_rigged_from_above(instance: Usd.Prim, here: Standing) -> bool:
    """Is a SkelRoot above the instance? Its skeletons may deform each instance otherwise."""
    return here.rig is not None and here.rig.root != here.on_stage(instance)
