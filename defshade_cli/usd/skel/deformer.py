"""One prim that a skeleton deforms: from its rest shape to a surface at a time."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import partial
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdSkel

from defshade_cli.scene.scene import Unsupported
from defshade_cli.spaces import Matrix
from defshade_cli.usd.polygons.polygons import Polygons, Primvar
from defshade_cli.usd.skel.animation import Animation, Pose
from defshade_cli.usd.skel.blendshapes import BlendShapes, Offsets, read_blend_shapes
from defshade_cli.usd.skel.body import Body, body_of, with_body
from defshade_cli.usd.skel.influences import Influences, read_influences
from defshade_cli.usd.skel.skinning import DualQuaternionBlend, LinearBlend, Skinning, inverse_transposes
from defshade_cli.usd.skel.transport import transported
from defshade_cli.usd.surfaces.geometry import Surface
from defshade_cli.usd.xform import matrix

T = TypeVar("T")

Skin = tuple[Skinning, Influences, Matrix]
"""How points move, by which joints, and from which bind pose."""


class Deformed(NamedTuple):
    """A surface in a pose.

    skeleton_from_surface: where it stands, in the space of its skeleton, which replaces the prim's own place; None
        for what stays where it is.
    """

    surface: Surface
    skeleton_from_surface: Matrix | None


class Deformer:
    """The deformation of one prim. The same rest shape in the same pose is the same object.

    A prim whose influences are constant moves as a whole: its matrix changes, and its surface does not.
    skeleton: the prim that places it; inside an instance the proxy.
    """

    def __init__(self, skinning: UsdSkel.SkinningQuery, query: UsdSkel.SkeletonQuery, skeleton: Usd.Prim) -> None:
        self.skeleton = skeleton
        self._skinning, self._animation = skinning, Animation(skinning, query)
        prim = skinning.GetPrim()
        self._bends = prim.IsA(UsdGeom.Mesh) or prim.IsA(UsdGeom.BasisCurves) or prim.IsA(UsdGeom.Points)
        self._shapes = _Remembered[tuple[BlendShapes, tuple[str, ...]]]()
        self._influences = _Remembered[Influences]()
        self._surface = _Remembered[Surface]()

    def at(self, rest: Surface, time: Usd.TimeCode) -> Deformed:
        """The surface of the rest shape at a time; with an issue, as it rests, where what is authored is of no use."""
        try:
            return self._at(rest, self._animation.at(time), time)
        except ValueError as error:
            return Deformed(self._at_rest(rest, str(error)), None)

    def _at(self, rest: Surface, pose: Pose, time: Usd.TimeCode) -> Deformed:
        if not self._skinning.HasJointInfluences():
            return Deformed(self._posed(rest, pose), None)
        is_rigid = self._skinning.IsRigidlyDeformed()
        if not (is_rigid or self._bends):
            raise ValueError("only meshes, curves and points are bent by a skeleton")
        influences = self._read_influences(pose, body_of(rest).authored, time)
        dual = self._skinning.GetSkinningMethod() == UsdSkel.Tokens.dualQuaternion
        skinning = DualQuaternionBlend(pose.joints) if dual else LinearBlend(pose.joints)
        bind = matrix(self._skinning.GetGeomBindTransform(time))
        if is_rigid:
            return Deformed(self._posed(rest, pose.without_joints()), rigid_motion(skinning, influences) @ bind)
        return Deformed(self._posed(rest, pose, (skinning, influences, bind)), np.eye(4))

    def _posed(self, rest: Surface, pose: Pose, skin: Skin | None = None) -> Surface:
        """Moulded by blend shapes, then bent."""

        def deform() -> Surface:
            body = body_of(rest)
            polygons, issues = self._moulded(body, pose)
            polygons = bent(polygons, *_of_rows(skin, body.rows)) if skin else polygons
            return self._renamed(with_body(rest, polygons), issues + self._of_animation)

        bind = skin[2].tobytes() if skin else b""
        return self._surface.of((rest, pose.key, skin and skin[1], bind), deform)

    @property
    def _of_animation(self) -> tuple[str, ...]:
        return (f"in the rest pose of its skeleton: {issue}",) if (issue := self._animation.issue) else ()

    def _moulded(self, body: Body, pose: Pose) -> tuple[Polygons, tuple[str, ...]]:
        if not (self._bends and self._skinning.HasBlendShapes()):
            return body.polygons, ()
        shapes, issues = self._shapes.of(body.authored, lambda: self._read_shapes(body.authored))
        return moulded(body.polygons, shapes.offsets(pose.weights).of(body.rows)), issues

    def _at_rest(self, rest: Surface, reason: str) -> Surface:
        issues = (f"drawn in its rest shape: {reason}",)
        return self._surface.of((rest, reason), lambda: self._renamed(rest, issues))

    def _renamed(self, surface: Surface, issues: tuple[str, ...]) -> Surface:
        path = str(self._skinning.GetPrim().GetPath())
        found = tuple(Unsupported(path, issue) for issue in issues)
        return replace(surface, path=path, issues=surface.issues + found)

    def _read_influences(self, pose: Pose, points: int, time: Usd.TimeCode) -> Influences:
        primvars = self._skinning.GetJointIndicesPrimvar(), self._skinning.GetJointWeightsPrimvar()
        varies = any(primvar.ValueMightBeTimeVarying() for primvar in primvars)
        read = partial(read_influences, self._skinning, time, len(pose.joints), points)
        return self._influences.of((points, time if varies else None), read)

    def _read_shapes(self, points: int) -> tuple[BlendShapes, tuple[str, ...]]:
        issues: list[str] = []
        shapes = read_blend_shapes(UsdSkel.BindingAPI(self._skinning.GetPrim()), points, issues)
        return shapes, tuple(issues)


class _Remembered(Generic[T]):
    """The last of something that follows from a key."""

    def __init__(self) -> None:
        self._last: tuple[Hashable, T] | None = None

    def of(self, key: Hashable, make: Callable[[], T]) -> T:
        if self._last is None or self._last[0] != key:
            self._last = key, make()
        return self._last[1]


def _of_rows(skin: Skin, rows: NDArray[np.integer] | None) -> Skin:
    skinning, influences, bind = skin
    return skinning, influences if rows is None else influences.of(rows), bind


def moulded(polygons: Polygons, offsets: Offsets) -> Polygons:
    """Polygons with offsets added to their points and normals; normals follow the shapes that say nothing of them."""
    moved = replace(polygons, points=(polygons.points + offsets.points).astype(np.float32))
    if moved.normals is None:
        return moved
    if offsets.silent.any() and len(polygons.counts):
        moved = replace(moved, normals=transported(polygons, (polygons.points + offsets.silent).astype(np.float32)))
    if moved.normals is None or not offsets.normals.any():
        return moved
    at_elements = _rows(moved.normals, moved)
    if at_elements is None:
        return replace(moved, normals=None)
    turned = moved.normals.values + offsets.normals[at_elements]
    return replace(moved, normals=replace(moved.normals, values=_unit(turned)))


def bent(polygons: Polygons, skinning: Skinning, influences: Influences, bind: Matrix) -> Polygons:
    """Polygons moved from bind to skeleton space; bind: (4, 4). Normals that no point has follow from the shape."""
    bound = polygons.points @ bind[:3, :3].T + bind[:3, 3]
    moved = replace(polygons, points=skinning.points(bound, influences).astype(np.float32))
    if moved.normals is None:
        return moved
    at_elements = _rows(moved.normals, moved)
    if at_elements is None:
        return replace(moved, normals=None)
    normals = moved.normals.values @ inverse_transposes(bind[None, :3, :3])[0].T
    of_elements = influences if moved.normals.interpolation != "faceVarying" else influences.of(at_elements)
    values = _unit(skinning.normals(normals, of_elements))
    return replace(moved, normals=replace(moved.normals, values=values))


def rigid_motion(skinning: Skinning, influences: Influences) -> Matrix:
    """(4, 4) skeleton_from_bind of what moves as one: where it takes the origin and the ends of the axes."""
    frame = np.concatenate([np.zeros((1, 3)), np.eye(3)])
    origin, *ends = skinning.points(frame, influences.of(np.zeros(4, np.intp)))
    motion = np.eye(4)
    motion[:3, :3] = (np.array(ends) - origin).T
    motion[:3, 3] = origin
    return motion


def _rows(normals: Primvar, polygons: Polygons) -> NDArray[np.integer] | None:
    """The point that each normal belongs to; None where it belongs to none."""
    match normals.interpolation:
        case "vertex" | "varying":
            return np.arange(len(polygons.points))
        case "faceVarying":
            return polygons.indices
        case _:
            return None


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float32]:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return (vectors / np.where(length == 0.0, 1.0, length)).astype(np.float32)
