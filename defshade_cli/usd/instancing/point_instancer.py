"""PointInstancers: arrays of copies, masked and sorted by prototype."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.instancing.instancing import Placement, read_color_of_instances, read_display_of_instances
from defshade_cli.usd.xform import matrices


@dataclass(frozen=True, slots=True, eq=False)
class Swarm:
    """A PointInstancer at one time: per prototype that it uses, the placement of its copies.

    issues: what was left out, and why; what pieces ask of it later adds to it.
    """

    placements: tuple[tuple[Sdf.Path, Placement], ...] = ()
    issues: Sequence[str] = ()


def read_point_instancer(prim: Usd.Prim, time: Usd.TimeCode, base: Usd.TimeCode) -> Swarm:
    """The copies of a PointInstancer in its own space, the prototypes' own transforms not yet applied.

    Which they are is read at the base, a frame, and where they are at a time near it.
    Masked instances are gone: inactiveIds, invisibleIds, an index without prototype, a transform that is not finite.
    """
    instancer, issues = UsdGeom.PointInstancer(prim), list[str]()
    indices = np.asarray(instancer.GetProtoIndicesAttr().Get(base) or [], np.int64)
    count = len(indices)
    if not count:
        return Swarm()
    prototypes = instancer.GetPrototypesRel().GetForwardedTargets()
    odd = _of_other_lengths(instancer, base, count)
    issues.extend(f"{name} is left out: {found} values where {count} are due" for name, found in odd.items())
    from_copy = _transforms_without(instancer, odd, base) if odd else _transforms(instancer, time, base)
    if len(from_copy) != count:
        return Swarm(issues=("positions and protoIndices differ in length",))
    kept = _mask(instancer, base, count)
    for valid, reason in (
        ((indices >= 0) & (indices < len(prototypes)), "instances have a protoIndex without prototype"),
        (np.isfinite(from_copy).all(axis=(1, 2)), "instances have a transform that is not finite"),
    ):
        if lost := np.count_nonzero(kept & ~valid):
            issues.append(f"{lost} {reason}")
        kept &= valid
    display = read_display_of_instances(prim, time, count, issues)
    other = cache(lambda primvar: read_color_of_instances(prim, time, count, issues, primvar))
    everyone = Placement(from_copy, _ids(instancer, base, count), *display, other_color=other)
    sorted_rows = _by_value(indices, kept)
    return Swarm(tuple((prototypes[k], _chosen(everyone, rows)) for k, rows in sorted_rows), issues)


def has_varying_copies(prim: Usd.Prim) -> bool:
    """May there be other copies at other times?"""
    instancer = UsdGeom.PointInstancer(prim)
    attributes = (instancer.GetProtoIndicesAttr(), instancer.GetPositionsAttr(), instancer.GetInvisibleIdsAttr())
    return any(attribute.ValueMightBeTimeVarying() for attribute in attributes)


def _of_other_lengths(instancer: UsdGeom.PointInstancer, time: Usd.TimeCode, count: int) -> dict[str, int]:
    """Arrays of another length than there are copies, and their lengths: USD reads beyond their ends."""
    attributes = (instancer.GetScalesAttr(), instancer.GetOrientationsAttr(), instancer.GetOrientationsfAttr())
    lengths = {str(attribute.GetName()): len(attribute.Get(time) or ()) for attribute in attributes}
    return {name: length for name, length in lengths.items() if length not in (0, count)}


def _transforms_without(
    instancer: UsdGeom.PointInstancer, names: Collection[str], time: Usd.TimeCode
) -> NDArray[np.float64]:
    """As if the instancer said nothing of these arrays, nor of what moves its copies on."""
    stage = Usd.Stage.CreateInMemory()
    alone = UsdGeom.PointInstancer.Define(stage, "/instancer")
    for name in ("protoIndices", "positions", "scales", "orientations", "orientationsf"):
        value = instancer.GetPrim().GetAttribute(name).Get(time)
        if name not in names and value is not None:
            alone.GetPrim().GetAttribute(name).Set(value)
    return _transforms(alone, Usd.TimeCode.Default(), Usd.TimeCode.Default())


def _transforms(instancer: UsdGeom.PointInstancer, time: Usd.TimeCode, base: Usd.TimeCode) -> NDArray[np.float64]:
    without_prototypes, unmasked = UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
    return matrices(instancer.ComputeInstanceTransformsAtTime(time, base, without_prototypes, unmasked))


def _mask(instancer: UsdGeom.PointInstancer, time: Usd.TimeCode, count: int) -> NDArray[np.bool_]:
    """USD's mask is empty where nothing is masked."""
    mask = np.array(instancer.ComputeMaskAtTime(time), bool)
    return mask if len(mask) == count else np.ones(count, bool)


def _ids(instancer: UsdGeom.PointInstancer, time: Usd.TimeCode, count: int) -> NDArray[np.int32]:
    """The authored ids; the instances' order where there are none, or none that int32 holds."""
    ids = np.asarray(instancer.GetIdsAttr().Get(time) or [], np.int64)
    fits = len(ids) == count and count > 0 and np.abs(ids).max() <= np.iinfo(np.int32).max
    return (ids if fits else np.arange(count)).astype(np.int32)


def _chosen(placement: Placement, rows: NDArray[np.intp]) -> Placement:
    other = placement.other_color
    return replace(
        placement,
        root_from_copy=placement.root_from_copy[rows],
        ids=placement.ids[rows],
        display_color=placement.display_color[rows],
        display_opacity=placement.display_opacity[rows],
        other_color=other and (lambda primvar: other(primvar)[rows]),
    )


def _by_value(values: NDArray[np.int64], kept: NDArray[np.bool_]) -> Iterator[tuple[int, NDArray[np.intp]]]:
    """Each value among the kept ones, with the rows that hold it."""
    rows = np.flatnonzero(kept)
    rows = rows[np.argsort(values[rows], kind="stable")]
    distinct, firsts = np.unique(values[rows], return_index=True)
    yield from zip(distinct.tolist(), np.split(rows, firsts[1:]), strict=False)
