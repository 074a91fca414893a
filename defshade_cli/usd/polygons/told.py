"""What a small mesh says, asked with few questions and not looked into: that is done for many at once, see checked.py.

Only meshes whose attributes have the types that are usual are asked so, and only where nothing needs to be said of
them but what is so common that it pays. All others are for usd/polygons/mesh.py, which knows what is wrong with them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, Vt

from defshade_cli.usd.polygons.end_to_end import LARGEST
from defshade_cli.usd.polygons.lying import MORE, Lying, told_carried, told_normals
from defshade_cli.usd.polygons.mesh import sizes_of
from defshade_cli.usd.polygons.polygons import SCHEMES, Scheme
from defshade_cli.usd.said import Said
from defshade_cli.usd.values import integers

_ALWAYS = Usd.TimeCode.Default()
"""Of what does not vary."""

_NO_HOLES = np.empty(0, np.int32)


class Told(NamedTuple):
    """Of a mesh what the fields of Polygons of these names hold, unless it is not sound. Only holes may be empty."""

    points: NDArray[np.float32]
    counts: NDArray[np.integer]
    indices: NDArray[np.int32]
    faces: NDArray[np.int32]
    holes: NDArray[np.integer]
    scheme: Scheme
    left_handed: bool
    normals: Lying | None
    carried: tuple[Lying, ...]

    @property
    def lying(self) -> tuple[Lying, ...]:
        """All that lies on it."""
        return self.carried if self.normals is None else (self.normals, *self.carried)


def told_of(said: Said, time: Usd.TimeCode, color: str) -> Told | None:
    """None where there is more to it. color: as read_surface has it."""
    names = said.names
    if "velocities" in names:
        return None
    indices = said.value("faceVertexIndices", time)
    if not isinstance(indices, Vt.IntArray) or not 0 < len(indices) <= LARGEST:
        return None
    counts, points = said.value("faceVertexCounts", time), said.value("points", time)
    if not (isinstance(counts, Vt.IntArray) and isinstance(points, Vt.Vec3fArray) and counts and points):
        return None
    scheme = said.value("subdivisionScheme", _ALWAYS) if "subdivisionScheme" in names else "catmullClark"
    sizes = sizes_of(np.asarray(counts))
    if scheme not in SCHEMES or sizes.corners != len(indices):
        return None
    normals = told_normals(said, time) if scheme == "none" else None
    carried = told_carried(said, time, color) if said.primvars else ()
    if normals is MORE or carried is None:
        return None
    holes = integers(said.value("holeIndices", time)) if "holeIndices" in names else None
    return Told(
        np.asarray(points),
        sizes.counts,
        np.asarray(indices),
        sizes.faces,
        _NO_HOLES if holes is None else holes,
        scheme,
        "orientation" in names and said.value("orientation", _ALWAYS) == UsdGeom.Tokens.leftHanded,
        normals,
        carried,
    )
