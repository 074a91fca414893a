"""The control mesh of a subdivision surface, as UsdGeomMesh writes it, checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, fields
from hashlib import blake2b
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.arrays import frozen

SchemeName = Literal["catmullClark", "loop", "bilinear"]
BoundaryRule = Literal["none", "edgeOnly", "edgeAndCorner"]
TriangleRule = Literal["catmullClark", "smooth"]

_CHOICES: dict[str, tuple[str, ...]] = {
    "scheme": get_args(SchemeName),
    "interpolate_boundary": get_args(BoundaryRule),
    "triangle_subdivision_rule": get_args(TriangleRule),
}


_INDICES = ("face_counts", "face_indices", "holes", "crease_indices", "crease_lengths", "corner_indices")
_SHARPNESSES = ("crease_sharpnesses", "corner_sharpnesses")
_ARRAYS: dict[str, type] = dict.fromkeys(_INDICES, np.int32) | dict.fromkeys(_SHARPNESSES, np.float64)

_NO_INDICES: NDArray[np.int32] = frozen([], np.int32, -1)
_NO_SHARPNESSES: NDArray[np.float64] = frozen([], np.float64, -1)
"""What most meshes have: not frozen again for each of them."""


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True, kw_only=True)
class Topology:
    """UsdGeomMesh's topology attributes; the schema's text says what each means.

    face_counts: (F,) int32.  face_indices: (sum of face_counts,) int32 into vertex_count points.
    holes: face indices.
    crease_indices: chains of vertices laid end to end, crease_lengths vertices each; crease_sharpnesses has one
        value a chain, or one for each edge of all chains. A crease along no edge of the mesh is ignored.
    corner_indices, corner_sharpnesses: one sharpness a vertex. Sharpness 10 and above is infinite.

    Raises ValueError with the reason where the arrays do not describe a mesh that the scheme takes.
    """

    face_counts: NDArray[Any]
    face_indices: NDArray[Any]
    vertex_count: int
    scheme: SchemeName = "catmullClark"
    interpolate_boundary: BoundaryRule = "edgeAndCorner"
    triangle_subdivision_rule: TriangleRule = "catmullClark"
    holes: NDArray[Any] = field(default_factory=lambda: _NO_INDICES)
    crease_indices: NDArray[Any] = field(default_factory=lambda: _NO_INDICES)
    crease_lengths: NDArray[Any] = field(default_factory=lambda: _NO_INDICES)
    crease_sharpnesses: NDArray[Any] = field(default_factory=lambda: _NO_SHARPNESSES)
    corner_indices: NDArray[Any] = field(default_factory=lambda: _NO_INDICES)
    corner_sharpnesses: NDArray[Any] = field(default_factory=lambda: _NO_SHARPNESSES)

    def __post_init__(self) -> None:
        for name, dtype in _ARRAYS.items():
            if (values := getattr(self, name)) is not _NO_INDICES and values is not _NO_SHARPNESSES:
                object.__setattr__(self, name, frozen(values, dtype, -1))
        self._check_rules()
        self._check_faces()
        self._check_creases()
        self._check_corners()

    def _check_rules(self) -> None:
        for name, choices in _CHOICES.items():
            if (value := getattr(self, name)) not in choices:
                raise ValueError(f"{name} is {value!r}, not one of {', '.join(choices)}")

    def _check_faces(self) -> None:
        counts = self.face_counts
        if not len(counts):
            raise ValueError("the mesh has no faces")
        if counts.min() < 3:
            face = int(counts.argmin())
            raise ValueError(f"face {face} has {counts[face]} vertices")
        total = int(counts.sum(dtype=np.int64))
        if total != len(self.face_indices):
            raise ValueError(f"faces need {total} vertex indices, got {len(self.face_indices)}")
        if self.scheme == "loop" and counts.max() > 3:
            face = int(counts.argmax())
            raise ValueError(f"the Loop scheme takes triangles only; face {face} has {counts[face]} vertices")
        _require_range("face index", self.face_indices, self.vertex_count, "points")
        _require_range("hole index", self.holes, len(counts), "faces")

    def _check_creases(self) -> None:
        lengths = self.crease_lengths
        if not (len(lengths) or len(self.crease_indices) or len(self.crease_sharpnesses)):
            return
        if len(lengths) and lengths.min() < 2:
            raise ValueError("a crease has fewer than two vertices")
        total = int(lengths.sum(dtype=np.int64))
        if total != len(self.crease_indices):
            raise ValueError(f"creases need {total} vertex indices, got {len(self.crease_indices)}")
        edges = total - len(lengths)
        if len(self.crease_sharpnesses) not in (len(lengths), edges):
            raise ValueError(f"{len(self.crease_sharpnesses)} sharpnesses for {len(lengths)} creases of {edges} edges")
        _require_range("crease index", self.crease_indices, self.vertex_count, "points")
        if np.isnan(self.crease_sharpnesses).any():
            raise ValueError("a crease sharpness is not a number")

    def _check_corners(self) -> None:
        if len(self.corner_indices) != len(self.corner_sharpnesses):
            raise ValueError(f"{len(self.corner_sharpnesses)} sharpnesses for {len(self.corner_indices)} corners")
        if not len(self.corner_indices):
            return
        _require_range("corner index", self.corner_indices, self.vertex_count, "points")
        if np.isnan(self.corner_sharpnesses).any():
            raise ValueError("a corner sharpness is not a number")

    @classmethod
    def end_to_end(cls, parts: Sequence[Topology]) -> Topology:
        """One of all `parts`, which have the same rules."""
        first = parts[0]
        points = np.cumsum([0, *(part.vertex_count for part in parts)])
        faces = np.cumsum([0, *(len(part.face_counts) for part in parts)])

        def laid(name: str, offsets: NDArray[Any]) -> NDArray[Any]:
            arrays = [getattr(part, name) for part in parts]
            return np.concatenate(arrays) + np.repeat(offsets[:-1], [len(array) for array in arrays])

        return cls(
            face_counts=np.concatenate([part.face_counts for part in parts]),
            face_indices=laid("face_indices", points),
            vertex_count=int(points[-1]),
            scheme=first.scheme,
            interpolate_boundary=first.interpolate_boundary,
            triangle_subdivision_rule=first.triangle_subdivision_rule,
            holes=laid("holes", faces),
            crease_indices=laid("crease_indices", points),
            crease_lengths=np.concatenate([part.crease_lengths for part in parts]),
            crease_sharpnesses=np.concatenate([part.crease_edges()[1] for part in parts]),
            corner_indices=laid("corner_indices", points),
            corner_sharpnesses=np.concatenate([part.corner_sharpnesses for part in parts]),
        )

    def equals(self, other: Topology) -> bool:
        """Do both describe the same mesh, so that stencils of one serve the other?"""
        return all(np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    def digest(self) -> bytes:
        """Equal for those that `equals` holds for."""
        found = blake2b(digest_size=16)
        for part in (getattr(self, f.name) for f in fields(self)):
            found.update(f"{np.shape(part)} ".encode())
            found.update(part.tobytes() if isinstance(part, np.ndarray) else str(part).encode())
        return found.digest()

    def crease_edges(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """(N, 2) vertex pairs of all creases and (N,) their sharpness."""
        if not len(self.crease_indices):
            return np.empty((0, 2), np.int32), self.crease_sharpnesses
        chain_starts = np.cumsum(self.crease_lengths)[:-1]
        joined = np.ones(max(len(self.crease_indices) - 1, 0), bool)
        joined[chain_starts - 1] = False
        pairs = np.stack([self.crease_indices[:-1], self.crease_indices[1:]], axis=1)[joined]
        sharpness = self.crease_sharpnesses
        if len(sharpness) != len(pairs):
            sharpness = np.repeat(sharpness, self.crease_lengths - 1)
        return pairs, sharpness


def _require_range(name: str, indices: NDArray[Any], count: int, of: str) -> None:
    if not len(indices) or 0 <= indices.min() <= indices.max() < count:
        return
    outside = (indices < 0) | (indices >= count)
    raise ValueError(f"{name} {indices[outside.argmax()]} is outside the {count} {of}")
