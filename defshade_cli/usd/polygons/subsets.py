"""The material subsets of a mesh: its triangles sorted into one run a subset."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdShade

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.polygons.vertices import Vertices
from defshade_cli.usd.said import Said
from defshade_cli.usd.values import integers


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
class Faces:
    """The authored faces of a prim by their materials.

    paths: prim path of the gprim, then of its subsets.
    group: (authored faces,) index into `paths` of each; None where all are in the first.
    """

    paths: tuple[str, ...]
    group: NDArray[np.intp] | None = None

    def groups_of(self, faces: NDArray[np.int32]) -> tuple[str, ...]:
        """The paths of the groups that these faces (N,) are in, in order."""
        if self.group is None:
            return self.paths if len(faces) else ()
        return tuple([self.paths[number] for number in np.flatnonzero(np.bincount(self.group[faces])).tolist()])

    def sort(self, drawn: Vertices) -> tuple[Vertices, tuple[FaceGroup, ...]]:
        """The same with its triangles sorted into groups, which cover them all."""
        if self.group is None:
            whole = FaceGroup(self.paths[0], 0, len(drawn.triangles))
            return drawn, (whole,) if whole.count else ()
        group = self.group[drawn.faces]
        order = np.argsort(group, kind="stable")
        counts = np.bincount(group, minlength=len(self.paths)).tolist()
        firsts = accumulate(counts, initial=0)
        groups = tuple([FaceGroup(p, first, c) for p, first, c in zip(self.paths, firsts, counts, strict=False) if c])
        return drawn._replace(triangles=drawn.triangles[order], faces=drawn.faces[order]), groups


def material_subsets(prim: Usd.Prim) -> list[UsdGeom.Subset]:
    """The subsets of the prim's faces in the family materialBind."""
    if not prim.GetAllChildrenNames():
        return []
    subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
    return [s for s in subsets if s.GetElementTypeAttr().Get() == UsdGeom.Tokens.face]


def read_faces(said: Said, subsets: list[UsdGeom.Subset], time: Usd.TimeCode, issues: list[str]) -> Faces:
    """Which subset holds each face, the gprim itself those that none does."""
    if not subsets:
        return Faces((said.path,))
    counts = integers(said.value("faceVertexCounts", time))
    group = _group_of_face(subsets, 0 if counts is None else len(counts), time, issues)
    return Faces((said.path, *(str(subset.GetPath()) for subset in subsets)), group)


def _group_of_face(
    subsets: list[UsdGeom.Subset], face_count: int, time: Usd.TimeCode, issues: list[str]
) -> NDArray[np.intp]:
    """(authored faces,) 1 + the subset that holds each, 0 for none; the first subset that claims a face has it."""
    group = np.zeros(face_count, np.intp)
    for number, subset in enumerate(subsets, start=1):
        indices = integers(subset.GetIndicesAttr().Get(time))
        if indices is None:
            continue
        name = subset.GetPrim().GetName()
        valid = indices[(indices >= 0) & (indices < face_count)]
        if len(valid) < len(indices):
            issues.append(f"subset {name}: {len(indices) - len(valid)} indices name no face")
        free = valid[group[valid] == 0]
        if len(free) < len(valid):
            issues.append(f"subset {name}: {len(valid) - len(free)} faces belong to an earlier subset")
        group[free] = number
    return group
