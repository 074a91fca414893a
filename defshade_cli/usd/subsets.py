"""The material subsets of a mesh: its triangles sorted into one run a subset."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdShade

from defshade_cli.scene.geometry import Mesh
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


def material_subsets(prim: Usd.Prim) -> list[UsdGeom.Subset]:
    """The subsets of the prim's faces in the family materialBind."""
    subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
    return [s for s in subsets if s.GetElementTypeAttr().Get() == UsdGeom.Tokens.face]


def group_faces(
    mesh: Mesh, prim: Usd.Prim, time: Usd.TimeCode, issues: list[str]
) -> tuple[Mesh, tuple[FaceGroup, ...]]:
    """The mesh with its triangles sorted into groups, the gprim's own first; the groups cover them all."""
    subsets = material_subsets(prim)
    if not subsets:
        whole = FaceGroup(mesh.path, 0, len(mesh.triangles))
        return mesh, (whole,) if whole.count else ()
    group_of_face = _group_of_face(subsets, UsdGeom.Mesh(prim).GetFaceCount(time), time, issues)
    group = group_of_face[mesh.faces]
    order = np.argsort(group, kind="stable")
    counts = np.bincount(group, minlength=len(subsets) + 1)
    paths = [mesh.path, *(str(subset.GetPath()) for subset in subsets)]
    firsts = np.cumsum(counts) - counts
    groups = (FaceGroup(p, int(f), int(c)) for p, f, c in zip(paths, firsts, counts, strict=True) if c)
    return replace(mesh, triangles=mesh.triangles[order], faces=mesh.faces[order]), tuple(groups)


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
