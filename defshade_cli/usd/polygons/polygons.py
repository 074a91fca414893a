"""A polygon mesh with what lies on its faces, points and corners, before it is cut into triangles.

Every surface passes through this form: a Mesh prim is read into it, a gprim is built in it, and refinement
takes and gives it. A corner is one face-vertex.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import field, replace
from functools import cached_property
from hashlib import blake2b
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass

Interpolation = Literal["constant", "uniform", "varying", "vertex", "faceVarying"]
Scheme = Literal["none", "bilinear", "catmullClark", "loop"]

SCHEMES: tuple[Scheme, ...] = ("none", "bilinear", "catmullClark", "loop")

EVERY = slice(None)
"""Of the corners."""

_CORNERS_AT_ONCE = 1 << 20
_FEW_CORNERS = 256


@dataclass(frozen=True, slots=True, eq=False)
class Primvar:
    """Values on a mesh: one for all, or one a face, a point or a corner.

    values: (N, 3) or (N,) float32, indices resolved.
    """

    values: NDArray[np.float32]
    interpolation: Interpolation

    @property
    def splits_points(self) -> bool:
        """Can two corners at one point differ?"""
        return self.interpolation in ("uniform", "faceVarying")


@dataclass(frozen=True, eq=False)
class Polygons:
    """F faces with C corners over P points.

    points: (P, 3) float32; those that a corner uses are finite.
    counts: (F,) integers, each at least 3, corners a face.
    indices: (C,) integers into points, face after face.
    faces: (F,) int32, the authored face that each is part of.
    holes: authored faces that shape the surface and are not drawn.
    scheme: how the surface follows from the polygons; `none` when they are the surface.
    left_handed: the corners run clockwise seen from outside.
    normals: None where they follow from the shape.
    uvs: texture coordinates (N, 2) by name.
    shown: primvars (N, 1 to 4) by name that only layers show.
    """

    points: NDArray[np.float32]
    counts: NDArray[np.integer]
    indices: NDArray[np.integer]
    faces: NDArray[np.int32]
    holes: NDArray[np.integer] = field(default_factory=lambda: np.empty(0, np.int32))
    scheme: Scheme = "none"
    left_handed: bool = False
    normals: Primvar | None = None
    display_color: Primvar | None = None
    display_opacity: Primvar | None = None
    uvs: Mapping[str, Primvar] = field(default_factory=dict)
    shown: Mapping[str, Primvar] = field(default_factory=dict)

    @property
    def primvars(self) -> tuple[Primvar, ...]:
        """All that lies on the faces, points and corners."""
        named = (self.normals, self.display_color, self.display_opacity, *self.uvs.values(), *self.shown.values())
        return tuple([primvar for primvar in named if primvar is not None])

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) least and greatest corner of the points that faces use; (+inf, −inf) without any."""
        used = self.points[self.indices].astype(np.float64)
        return np.stack([used.min(axis=0, initial=np.inf), used.max(axis=0, initial=-np.inf)])

    @cached_property
    def following(self) -> NDArray[np.intp]:
        """(C,) the corner after each, around its face."""
        following = np.arange(1, len(self.indices) + 1)
        ends = np.cumsum(self.counts, dtype=np.intp)
        following[ends - 1] = ends - self.counts
        return following

    @cached_property
    def face_of_corner(self) -> NDArray[np.int32]:
        """(C,) the face that each corner is part of."""
        return np.repeat(np.arange(len(self.counts), dtype=np.int32), self.counts)

    @cached_property
    def is_hole(self) -> NDArray[np.bool_]:
        """(F,) the faces that shape the surface and are not drawn."""
        if not len(self.holes):
            return np.zeros(len(self.faces), bool)
        marked = np.zeros(max(self.faces.max(initial=0), self.holes.max()) + 1, bool)
        marked[self.holes] = True
        return marked[self.faces]

    @property
    def drawn_faces(self) -> NDArray[np.int32]:
        """The authored faces that those are part of which are drawn."""
        return self.faces[~self.is_hole] if len(self.holes) else self.faces

    def by_size(self) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """Blocks of B faces that all have n corners: the faces (B,), and their corners (B, n)."""
        if not len(self.counts):
            return
        smallest, largest = int(self.counts.min()), int(self.counts.max())
        if smallest == largest:
            yield from self._blocks(largest)
            return
        starts = np.cumsum(self.counts, dtype=np.intp) - self.counts
        for size in np.flatnonzero(np.bincount(self.counts)):
            block = max(1, _CORNERS_AT_ONCE // int(size))
            sized = np.flatnonzero(self.counts == size)
            for first in range(0, len(sized), block):
                faces = sized[first : first + block]
                yield faces, starts[faces, None] + np.arange(size)

    def _blocks(self, size: int) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """The same where all faces have `size` corners."""
        corners = np.arange(len(self.indices)).reshape(-1, size)
        block = max(1, _CORNERS_AT_ONCE // size)
        for first in range(0, len(corners), block):
            part = corners[first : first + block]
            yield np.arange(first, first + len(part)), part

    def any_corner(self, corners: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(F,) the faces with a corner for which `corners` (C,) holds."""
        return np.bincount(self.face_of_corner[corners], minlength=len(self.counts)) > 0

    def select(self, kept: NDArray[np.bool_]) -> Polygons:
        """The faces for which `kept` (F,) holds; the points all stay."""
        if kept.all():
            return self
        corners = kept[self.face_of_corner]

        def pick(primvar: Primvar) -> Primvar:
            if not primvar.splits_points:
                return primvar
            mask = kept if primvar.interpolation == "uniform" else corners
            return replace(primvar, values=primvar.values[mask])

        chosen = replace(self, counts=self.counts[kept], indices=self.indices[corners], faces=self.faces[kept])
        return chosen.with_primvars(pick)

    def with_primvars(self, change: Callable[[Primvar], Primvar]) -> Polygons:
        """The same with every primvar changed."""

        def changed(primvar: Primvar | None) -> Primvar | None:
            return None if primvar is None else change(primvar)

        return replace(
            self,
            normals=changed(self.normals),
            display_color=changed(self.display_color),
            display_opacity=changed(self.display_opacity),
            uvs={name: change(uv) for name, uv in self.uvs.items()},
            shown={name: change(primvar) for name, primvar in self.shown.items()},
        )

    def without_constants(self) -> Polygons:
        """Without the colour and the opacity that all of it has; a surface knows those."""
        color = varying(self.display_color)
        opacity = varying(self.display_opacity)
        if color is self.display_color and opacity is self.display_opacity:
            return self
        return replace(self, display_color=color, display_opacity=opacity)

    @cached_property
    def wiring(self) -> Hashable:
        """Equal for polygons of one scheme that join as many points alike, and have the same holes."""
        arrays = [self.counts, self.indices]
        if len(self.holes):
            arrays.append(np.flatnonzero(self.is_hole))
        said = self.scheme, len(self.points), *[array.dtype.char for array in arrays]
        if len(self.indices) <= _FEW_CORNERS:
            return said, *[array.tobytes() for array in arrays]
        return said, *[blake2b(np.ascontiguousarray(array).data, digest_size=16).digest() for array in arrays]

    @property
    def place(self) -> bytes:
        """Equal for polygons over equal points."""
        if len(self.points) <= _FEW_CORNERS:
            return self.points.tobytes()
        return blake2b(np.ascontiguousarray(self.points).data, digest_size=16).digest()

    @cached_property
    def digest(self) -> Hashable:
        """Equal for polygons that are equal in everything: of few corners their bytes, else a hash of these."""
        arrays = [self.points, self.counts, self.indices, self.faces, self.holes]
        said: list[Hashable] = [self.scheme, self.left_handed, *self.uvs, 0, *self.shown]
        named = (self.normals, self.display_color, self.display_opacity, *self.uvs.values(), *self.shown.values())
        if named != (None, None, None):
            said += [primvar and primvar.interpolation for primvar in named]
            arrays += [primvar.values for primvar in named if primvar]
        said += [array.dtype.char for array in arrays]
        said += [array.shape for array in arrays]
        if len(self.indices) <= _FEW_CORNERS:
            return tuple(said), b"".join([array.tobytes() for array in arrays])
        found = blake2b(digest_size=16)
        for array in arrays:
            found.update(np.ascontiguousarray(array).data)
        return tuple(said), found.digest()

    def without_holes(self) -> Polygons:
        """Without the faces that are holes."""
        return self.select(~self.is_hole) if len(self.holes) else self

    def joined(self) -> Polygons:
        """The same with every primvar joined."""
        if all(primvar.interpolation != "faceVarying" for primvar in self.primvars):
            return self
        return self.with_primvars(self.join)

    def join(self, primvar: Primvar) -> Primvar:
        """A face-varying primvar on the points, where the corners at every point agree."""
        if primvar.interpolation != "faceVarying" or not len(primvar.values):
            return primvar
        at_points = primvar.values[self._a_corner]
        agree = np.array_equal(at_points[self.indices], primvar.values)
        return Primvar(at_points, "vertex") if agree else primvar

    @cached_property
    def _a_corner(self) -> NDArray[np.intp]:
        """(P,) some corner at each point; the first of all at a point without."""
        corner = np.zeros(len(self.points), np.intp)
        corner[self.indices] = np.arange(len(self.indices))
        return corner

    def at_corners(self, primvar: Primvar, corners: NDArray[np.intp] | slice = EVERY) -> NDArray[np.float32]:
        """(C, ...) a primvar of any interpolation; of corners (B, n) alone it is (B, n, ...)."""
        match primvar.interpolation:
            case "constant":
                return np.broadcast_to(primvar.values, (*self.indices[corners].shape, *primvar.values.shape[1:]))
            case "uniform":
                return primvar.values[self.face_of_corner[corners]]
            case "faceVarying":
                return primvar.values[corners]
            case _:
                return primvar.values[self.indices[corners]]

    def at_points(self, primvar: Primvar) -> NDArray[np.float32]:
        """(P, ...) a primvar that does not split points."""
        assert not primvar.splits_points
        return np.broadcast_to(primvar.values, (len(self.points), *primvar.values.shape[1:]))


def varying(primvar: Primvar | None) -> Primvar | None:
    """It, if it differs over the mesh."""
    return None if primvar is not None and primvar.interpolation == "constant" else primvar
