"""In-memory stages with one surface, and what tests ask of its triangles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pxr import Sdf, Usd, UsdGeom, UsdUtils, Vt

from defshade_cli.scene.geometry import Mesh
from defshade_cli.scene.scene import Unsupported
from defshade_cli.usd.polygons.refiner import Refiner
from defshade_cli.usd.surfaces.geometry import FaceGroup, Gprim, Surface, read_surface, tessellate

DEFAULT = Usd.TimeCode.Default()
CUBE_POINTS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
CUBE_FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def new_stage() -> Usd.Stage:
    """An empty stage in memory, kept alive by USD's cache: prims hold none."""
    stage = Usd.Stage.CreateInMemory()
    UsdUtils.StageCache.Get().Insert(stage)
    return stage


def define_mesh(points: ArrayLike, faces: Sequence[Sequence[int]], scheme: str = "none") -> UsdGeom.Mesh:
    """A Mesh prim at /mesh."""
    counts = [len(face) for face in faces]
    return define_raw_mesh(points, counts, [index for face in faces for index in face], scheme)


def define_raw_mesh(points: ArrayLike, counts: ArrayLike, indices: ArrayLike, scheme: str = "none") -> UsdGeom.Mesh:
    mesh = UsdGeom.Mesh.Define(new_stage(), "/mesh")
    with np.errstate(over="ignore"):
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(points, np.float32).reshape(-1, 3)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.asarray(counts, np.int32).ravel()))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.asarray(indices, np.int32).ravel()))
    mesh.CreateSubdivisionSchemeAttr(scheme)
    return mesh


def define_cube(scheme: str = "none") -> UsdGeom.Mesh:
    return define_mesh(CUBE_POINTS, CUBE_FACES, scheme)


def set_primvar(
    prim: UsdGeom.Imageable, name: str, values: object, interpolation: str, type_name: str = "color3f[]"
) -> UsdGeom.Primvar:
    api = UsdGeom.PrimvarsAPI(prim)
    primvar = api.CreatePrimvar(name, Sdf.ValueTypeNames.Find(type_name), interpolation)
    primvar.Set(values)
    return primvar


@dataclass(frozen=True)
class Drawn:
    """What becomes of a prim: its surface's constants, its triangles, and the issues of both."""

    surface: Surface
    gprim: Gprim

    @property
    def mesh(self) -> Mesh:
        return self.gprim.mesh

    @property
    def groups(self) -> tuple[FaceGroup, ...]:
        return self.gprim.groups

    @property
    def display_color(self) -> NDArray[np.float32] | None:
        return self.surface.display_color

    @property
    def display_opacity(self) -> float | None:
        return self.surface.display_opacity

    @property
    def issues(self) -> tuple[Unsupported, ...]:
        return self.surface.issues + self.gprim.issues


def read(schema: UsdGeom.Gprim, time: Usd.TimeCode = DEFAULT, level: int = 0) -> Drawn:
    """The prim in triangles, `level` times refined where it is a subdivision surface."""
    drawn = try_read(schema.GetPrim(), time, level)
    assert drawn is not None
    return drawn


def try_read(prim: Usd.Prim, time: Usd.TimeCode, level: int = 0) -> Drawn | None:
    """None for a prim that is no surface."""
    surface = read_surface(prim, time)
    if surface is None:
        return None
    refiner = Refiner(surface.control, level) if surface.control and level else None
    return Drawn(surface, tessellate(surface, refiner))


def reasons(drawn: Drawn) -> list[str]:
    return [issue.reason for issue in drawn.issues]


def corners(mesh: Mesh) -> NDArray[np.float64]:
    """(T, 3, 3) the points of each triangle."""
    return mesh.points[mesh.triangles].astype(np.float64)


def vector_areas(mesh: Mesh) -> NDArray[np.float64]:
    """(T, 3) normals of the triangles by their winding, as long as their areas."""
    a, b, c = corners(mesh).swapaxes(0, 1)
    return 0.5 * np.cross(b - a, c - a)


def area(mesh: Mesh) -> float:
    return float(np.linalg.norm(vector_areas(mesh), axis=1).sum())


def volume(mesh: Mesh) -> float:
    """Enclosed by a closed mesh, positive when it is wound outwards (divergence theorem)."""
    return float(np.einsum("ti,ti->", vector_areas(mesh), corners(mesh)[:, 0]) / 3.0)


def is_watertight(mesh: Mesh) -> bool:
    """Does every edge, by position, have as many triangles on one side as on the other?"""
    _, point = np.unique(mesh.points + 0.0, axis=0, return_inverse=True)
    triangles = point.reshape(-1)[mesh.triangles]
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = edges[edges[:, 0] != edges[:, 1]]
    ahead, behind = (np.sort(e[:, 0] * (len(point) + 1) + e[:, 1]) for e in (edges, edges[:, ::-1]))
    return bool(np.array_equal(ahead, behind))
