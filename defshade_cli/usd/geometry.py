"""Any surface prim of a stage as one triangulated scene.Mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from defshade_cli.scene.geometry import Mesh
from defshade_cli.scene.scene import Unsupported


@dataclass(frozen=True, slots=True, eq=False)
class FaceGroup:
    """A run of triangles that share a material binding.

    path: prim path of the GeomSubset, or of the gprim for the faces that no subset holds.
    first, count: triangles.
    """

    path: str
    first: int
    count: int


@dataclass(frozen=True, slots=True, eq=False)
class Gprim:
    """A surface prim at one time, in object space.

    mesh: triangles sorted so that each group is one run.
    groups: cover every triangle, in order; none is empty.
    display_color: (3,) float32, the constant authored or inherited value; None where there is none or where it
        varies, and mesh.display_color has it. display_opacity likewise.
    issues: what was left out or mended of this prim, and why.
    """

    mesh: Mesh
    groups: tuple[FaceGroup, ...]
    display_color: NDArray[np.float32] | None
    display_opacity: float | None
    issues: tuple[Unsupported, ...]


def read_gprim(prim: Usd.Prim, time: Usd.TimeCode) -> Gprim | None:
    """The surface of `prim`; None for a type that is no supported surface. Bad data ends in issues, never raises.

    A surface of which nothing can be drawn has a mesh without triangles, no groups, and issues that say why.
    """
    raise NotImplementedError


def is_time_varying(prim: Usd.Prim) -> bool:
    """Does anything that read_gprim reads, primvars inherited and face subsets included, differ over time?"""
    raise NotImplementedError
