"""The control mesh of a subdivision surface, as far as a UsdGeom.Mesh says more of it than polygons."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TYPE_CHECKING, cast, get_args
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.said import Said
from defshade_cli.usd.values import floats, integers

if TYPE_CHECKING:
    from defshade_cli.usd.subdivision import LinearInterpolation, Topology
    from defshade_cli.usd.subdivision.topology import BoundaryRule, SchemeName, TriangleRule

CONTROL_ATTRIBUTES = (
    "creaseIndices",
    "creaseLengths",
    "creaseSharpnesses",
    "cornerIndices",
    "cornerSharpnesses",
    "interpolateBoundary",
    "triangleSubdivisionRule",
    "faceVaryingLinearInterpolation",
)
"""What is read of a Mesh that may vary over time, besides what its polygons need."""

_PLAIN: WeakValueDictionary[Hashable, Topology] = WeakValueDictionary()
_FACE_VARYING_FALLBACK: LinearInterpolation = "cornersPlus1"


@dataclass(frozen=True, slots=True, eq=False)
class Control:
    """How a surface follows from its cage. face_varying: how face-varying primvars are refined."""

    topology: Topology
    face_varying: LinearInterpolation = _FACE_VARYING_FALLBACK

    @property
    def rules(self) -> Hashable:
        """What cages have in common that can be refined as one."""
        topology = self.topology
        return (
            topology.scheme,
            topology.interpolate_boundary,
            topology.triangle_subdivision_rule,
            self.face_varying,
        )

    def equals(self, other: Control) -> bool:
        """Whether both subdivide alike: topology and face-varying indices are the same."""
        return self.face_varying == other.face_varying and (
            self.topology is other.topology or self.topology.equals(other.topology)
        )

    def triangle_count(self, level: int) -> int:
        """Triangles at `level`, holes counted: every face becomes four, but for a first split into quads."""
        topology = self.topology
        faces, corners = len(topology.face_counts), len(topology.face_indices)
        if level == 0 or topology.scheme == "loop":
            return (corners - 2 * faces) * 4**level
        return corners * 2 * 4 ** (level - 1)


def read_control(
    mesh: UsdGeom.Mesh, said: Said, polygons: Polygons, time: Usd.TimeCode, issues: list[str]
) -> Control | None:
    """None where the polygons are the surface, and where what is authored describes none."""
    if polygons.scheme == "none" or not len(polygons.counts):
        return None
    says_more = not set(CONTROL_ATTRIBUTES).isdisjoint(said.names)
    try:
        topology = _read_topology(mesh, polygons, time) if says_more else _plain_topology(polygons)
    except ValueError as error:
        issues.append(f"drawn without subdivision: {error}")
        return None
    if not says_more:
        return Control(topology)
    return Control(topology, _face_varying(mesh, time, issues))


def smooth_control(polygons: Polygons) -> Control | None:
    """Of a cage without creases, corners or holes; None where the polygons are the surface."""
    return None if polygons.scheme == "none" else Control(_plain_topology(polygons))


def _plain_topology(polygons: Polygons) -> Topology:
    """With the schema's rules, and without creases and corners; the same for polygons that are wired alike."""
    from defshade_cli.usd.subdivision import Topology

    known = _PLAIN.get(polygons.wiring)
    if known is None:
        known = _PLAIN[polygons.wiring] = Topology(
            face_counts=polygons.counts,
            face_indices=polygons.indices,
            vertex_count=len(polygons.points),
            scheme=cast("SchemeName", polygons.scheme),
            holes=np.flatnonzero(polygons.is_hole),
        )
    return known


def _read_topology(mesh: UsdGeom.Mesh, polygons: Polygons, time: Usd.TimeCode) -> Topology:
    """Raises ValueError where the arrays contradict each other."""
    from defshade_cli.usd.subdivision import Topology

    return Topology(
        face_counts=polygons.counts,
        face_indices=polygons.indices,
        vertex_count=len(polygons.points),
        scheme=cast("SchemeName", polygons.scheme),
        interpolate_boundary=cast("BoundaryRule", mesh.GetInterpolateBoundaryAttr().Get(time)),
        triangle_subdivision_rule=cast("TriangleRule", mesh.GetTriangleSubdivisionRuleAttr().Get(time)),
        holes=np.flatnonzero(polygons.is_hole),
        crease_indices=_indices(mesh.GetCreaseIndicesAttr(), time),
        crease_lengths=_indices(mesh.GetCreaseLengthsAttr(), time),
        crease_sharpnesses=_sharpnesses(mesh.GetCreaseSharpnessesAttr(), time),
        corner_indices=_indices(mesh.GetCornerIndicesAttr(), time),
        corner_sharpnesses=_sharpnesses(mesh.GetCornerSharpnessesAttr(), time),
    )


def _face_varying(mesh: UsdGeom.Mesh, time: Usd.TimeCode, issues: list[str]) -> LinearInterpolation:
    from defshade_cli.usd.subdivision import LinearInterpolation

    rule = mesh.GetFaceVaryingLinearInterpolationAttr().Get(time)
    if rule in get_args(LinearInterpolation):
        return cast(LinearInterpolation, rule)
    issues.append(f"faceVaryingLinearInterpolation {rule!r} is unknown; {_FACE_VARYING_FALLBACK} is taken")
    return _FACE_VARYING_FALLBACK


def _indices(attribute: Usd.Attribute, time: Usd.TimeCode) -> NDArray[np.integer]:
    value = attribute.Get(time)
    found = None if value is None else integers(value)
    return np.empty(0, np.int32) if found is None else found


def _sharpnesses(attribute: Usd.Attribute, time: Usd.TimeCode) -> NDArray[np.float32]:
    value = attribute.Get(time)
    found = None if value is None else floats(value, 1)
    return np.empty(0, np.float32) if found is None else found
