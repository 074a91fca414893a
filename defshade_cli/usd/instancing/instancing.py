"""Instancing, native and by PointInstancer, as one operation: a subtree placed N times.

    subtree    the pieces below some root prims, in the space that these stand in
    placement  N transforms of that space, and what every copy inherits

A stage is a subtree; so is a prototype of either kind. Placing a subtree fills what its pieces leave open (None, or
NaN in arrays) and multiplies its matrices, in NumPy: instances of instances cost no Python loop.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import chain, compress, repeat
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import StageError
from defshade_cli.scene.light import Light
from defshade_cli.usd.materials.bindings import NOTHING_BOUND, Bindings
from defshade_cli.usd.polygons.primvars import DISPLAY_COLOR, Elements, read_display
from defshade_cli.usd.said import NOTHING_INHERITED, Inherited
from defshade_cli.usd.surfaces.geometry import Surface
from defshade_cli.usd.values import within_reach
from defshade_cli.usd.xform import IDENTITY

if TYPE_CHECKING:
    from defshade_cli.usd.skel import Rig

MOST_COPIES = 1 << 24
"""Of one prim: their matrices take 2 GiB. Thirty prims that each instance another twice are a billion."""


class Standing(NamedTuple):
    """What a prim hands down.

    in_world: root_from_prim leads to world space, because an xform stack was reset.
    draw_mode: of the models below; None below what is no model, where there are no others.
    rig: the outermost SkelRoot.
    proxied: the prototype that is walked and an instance of it, by whose proxies its prims are known on the stage.
    primvars: that are inherited below it; into a prototype USD lets none.
    outer: what is bound outside the prototype that is walked, see Materials.outer.
    """

    root_from_prim: Gf.Matrix4d = IDENTITY
    in_world: bool = False
    purpose: str | None = None
    draw_mode: str | None = None
    rig: Rig | None = None
    proxied: tuple[Sdf.Path, Sdf.Path] | None = None
    primvars: Inherited = NOTHING_INHERITED
    outer: Bindings = NOTHING_BOUND

    def on_stage(self, prim: Usd.Prim) -> Usd.Prim:
        """The prim, or the proxy of one in a prototype."""
        if self.proxied is None:
            return prim
        return prim.GetStage().GetPrimAtPath(prim.GetPath().ReplacePrefix(*self.proxied))

    def with_rig(self, root: Usd.Prim) -> Standing:
        """The same with a SkelRoot that stands here, unless one stands above."""
        from defshade_cli.usd.skel import Rig

        return self if self.rig else self._replace(rig=Rig(self.on_stage(root), self.root_from_prim, self.in_world))

    def inside(self, instance: Usd.Prim, outer: Bindings) -> Standing:
        """What an instance hands down into its prototype: nothing but its rig, and what is bound out here."""
        proxy = self.on_stage(instance)
        rig = self.rig and type(self.rig)(proxy, IDENTITY, False)
        proxied = instance.GetPrototype().GetPath(), proxy.GetPath()
        return Standing(rig=rig, proxied=proxied, outer=outer)


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A surface or a light where it stands in a subtree, N times.

    root_from_object: (N, 4, 4) float64; world space where `in_world`, because the prim resets its xform stack.
    paths: of each, or one that all share.
    ids: (N,) int32 as Drawable.instance_ids; the outermost instance counts.
    bindings: of each group of a surface, by the group's path.
    display_color, display_opacity: (N, 3) and (N,) float32.
    """

    content: Surface | Light
    root_from_object: NDArray[np.float64]
    paths: tuple[str, ...]
    ids: NDArray[np.int32]
    display_color: NDArray[np.float32]
    display_opacity: NDArray[np.float32]
    purpose: str | None = None
    bindings: Mapping[str, Bindings] = field(default_factory=dict)
    in_world: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Where copies of a subtree stand in the one above it; fields as in Piece.

    roots: path of each copy's root, which replaces `prototype` in the paths of its pieces; none where they share it.
    other_color: what copies have of another primvar, in the place of display_color.
    """

    root_from_copy: NDArray[np.float64]
    ids: NDArray[np.int32]
    display_color: NDArray[np.float32]
    display_opacity: NDArray[np.float32]
    purpose: str | None = None
    bindings: Bindings = NOTHING_BOUND
    in_world: bool = False
    prototype: str = ""
    roots: tuple[str, ...] = ()
    other_color: Callable[[str], NDArray[np.float32]] | None = None

    def colored_by(self, primvar: str) -> Placement:
        """The same for pieces that read their colour from a primvar."""
        if primvar == DISPLAY_COLOR or self.other_color is None:
            return self
        return replace(self, display_color=self.other_color(primvar))


def place(pieces: Iterable[Piece], placement: Placement) -> Iterator[Piece]:
    """Every piece of a subtree at every placement, placement by placement. Raises StageError for too many."""
    for piece in pieces:
        count = len(piece.ids) * len(placement.ids)
        if count > MOST_COPIES:
            raise StageError(f"{piece.paths[0]} stands {count:,} times, and no more than {MOST_COPIES:,} can be drawn")
        yield replace(
            piece,
            root_from_object=_placed(piece, placement),
            paths=_paths(piece, placement),
            ids=np.repeat(placement.ids, len(piece.ids)),
            display_color=_filled(piece.display_color, placement.display_color),
            display_opacity=_filled(piece.display_opacity, placement.display_opacity),
            purpose=piece.purpose or placement.purpose,
            bindings={path: bindings.under(placement.bindings) for path, bindings in piece.bindings.items()},
            in_world=piece.in_world or placement.in_world,
        )


def finite(pieces: Sequence[Piece]) -> tuple[tuple[Piece, ...], tuple[str, ...]]:
    """The pieces where their transforms put them, and the paths of those that stand nowhere."""
    if not pieces or within_reach(np.concatenate([piece.root_from_object for piece in pieces])).all():
        return tuple(pieces), ()
    masks: list[NDArray[np.bool_]] = [np.all(within_reach(piece.root_from_object), axis=(1, 2)) for piece in pieces]
    kept = [some(piece, mask) if not mask.all() else piece for piece, mask in zip(pieces, masks, strict=True)]
    lost = (path for piece, mask in zip(pieces, masks, strict=True) for path in _paths_where(piece, ~mask))
    return tuple(piece for piece in kept if len(piece.ids)), tuple(dict.fromkeys(lost))


def read_display_of_instances(
    prim: Usd.Prim, time: Usd.TimeCode, count: int, issues: list[str]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """displayColor (count, 3) and displayOpacity (count,) that copies inherit from their instance or instancer.

    NaN where nothing is authored. As the PointInstancer schema says: constant and uniform values are everyone's, any
    other interpolation has one value a copy.
    """
    opacity = read_display(prim, "displayOpacity", 1, time, _elements(count), issues)
    return (
        read_color_of_instances(prim, time, count, issues, DISPLAY_COLOR),
        np.broadcast_to(np.float32(np.nan) if opacity is None else opacity.values, (count,)),
    )


def read_color_of_instances(
    prim: Usd.Prim, time: Usd.TimeCode, count: int, issues: list[str], primvar: str
) -> NDArray[np.float32]:
    """(count, 3) of displayColor, or of what is read in its place, likewise."""
    color = read_display(prim, primvar, 3, time, _elements(count), issues)
    return np.broadcast_to(np.float32(np.nan) if color is None else color.values, (count, 3))


def _elements(count: int) -> Elements:
    return {"constant": 1, "uniform": 1, "varying": count, "vertex": count, "faceVarying": count}


def _placed(piece: Piece, placement: Placement) -> NDArray[np.float64]:
    outer, inner = placement.root_from_copy[:, None], piece.root_from_object[None]
    if piece.in_world:
        outer = np.broadcast_to(np.eye(4), outer.shape)
    return (outer @ inner).reshape(-1, 4, 4)


def _filled(inner: NDArray[np.float32], outer: NDArray[np.float32]) -> NDArray[np.float32]:
    """The piece's values at every placement, the placement's where they are NaN."""
    return np.where(np.isnan(inner[None]), outer[:, None], inner[None]).reshape(-1, *inner.shape[1:])


def _paths(piece: Piece, placement: Placement) -> tuple[str, ...]:
    if not placement.roots:
        return piece.paths if len(piece.paths) == 1 else piece.paths * len(placement.root_from_copy)
    inside = f"{placement.prototype}/"
    copies = (
        [path.replace(inside, f"{root}/", 1) if path.startswith(inside) else path for path in piece.paths]
        for root in placement.roots
    )
    repeats = len(piece.ids) // len(piece.paths)
    return tuple(chain.from_iterable(chain.from_iterable(repeat(names, repeats) for names in copies)))


def some(piece: Piece, mask: NDArray[np.bool_]) -> Piece:
    """Those of its N for which `mask` (N,) holds."""
    return replace(
        piece,
        root_from_object=piece.root_from_object[mask],
        paths=_paths_where(piece, mask),
        ids=piece.ids[mask],
        display_color=piece.display_color[mask],
        display_opacity=piece.display_opacity[mask],
    )


def _paths_where(piece: Piece, mask: NDArray[np.bool_]) -> tuple[str, ...]:
    if len(piece.paths) != len(mask):
        return piece.paths if mask.any() else ()
    return tuple(compress(piece.paths, mask))
