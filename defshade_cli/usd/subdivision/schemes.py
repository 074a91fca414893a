"""The subdivision schemes: how each splits faces and weighs points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.subdivision import bilinear, catmull_clark, loop
from defshade_cli.usd.subdivision.cage import Cage
from defshade_cli.usd.subdivision.stencil import Masks, identity
from defshade_cli.usd.subdivision.topology import Topology

Angles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Scheme:
    """Functions of one level's cage.

    split: the next level.  refine: masks of its points.
    limit: masks of where the cage's own points end; its faces have `face_size` vertices.
    across, sector_weights: what limit tangents weigh, see catmull_clark.
    faceted: whether every face has normals of its own, as in bilinear interpolation.
    """

    split: Callable[[Cage], Cage]
    refine: Callable[[Cage], Masks]
    limit: Callable[[Cage], Masks]
    across: Callable[[Angles], Angles]
    sector_weights: Callable[[Angles], tuple[Angles, Angles]]
    face_size: int
    faceted: bool = False


def _stay(cage: Cage) -> Masks:
    return identity(cage.vertex_count)


CATMULL_CLARK = Scheme(
    Cage.split_to_quads,
    catmull_clark.refine,
    catmull_clark.limit,
    catmull_clark.across,
    catmull_clark.sector_weights,
    face_size=4,
)
CATMULL_CLARK_SMOOTH_TRIANGLES = replace(CATMULL_CLARK, refine=catmull_clark.refine_smooth_triangles)
LOOP = Scheme(Cage.split_to_triangles, loop.refine, loop.limit, loop.across, loop.sector_weights, face_size=3)
BILINEAR = replace(CATMULL_CLARK, refine=bilinear.refine_quads, limit=_stay, faceted=True)
LINEAR_TRIANGLES = replace(LOOP, refine=bilinear.refine_triangles, limit=_stay, faceted=True)


def scheme_of(topology: Topology) -> Scheme:
    """The rules that the topology asks for."""
    if topology.scheme == "catmullClark":
        smooth_triangles = topology.triangle_subdivision_rule == "smooth"
        return CATMULL_CLARK_SMOOTH_TRIANGLES if smooth_triangles else CATMULL_CLARK
    return LOOP if topology.scheme == "loop" else BILINEAR


def linear_scheme_of(topology: Topology) -> Scheme:
    """The scheme that splits the same faces and interpolates linearly."""
    return LINEAR_TRIANGLES if topology.scheme == "loop" else BILINEAR
