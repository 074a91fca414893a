"""Small control meshes and their parts, for the tests of subdivision."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from defshade_cli.usd.subdivision import Topology, limit, refine

CUBE_POINTS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
CUBE_FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
TETRAHEDRON = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
OCTAHEDRON = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
PYRAMID = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [3, 2, 1, 0]]
TWO_BY_TWO = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]]


def topology(faces: list[list[int]], **options: Any) -> Topology:
    indices = np.concatenate([np.asarray(face) for face in faces])
    options.setdefault("vertex_count", int(indices.max()) + 1)
    return Topology(face_counts=[len(face) for face in faces], face_indices=indices, **options)


def creased(edges: list[tuple[int, int]], sharpness: float | list[float]) -> dict[str, Any]:
    return {
        "crease_indices": np.ravel(edges),
        "crease_lengths": [2] * len(edges),
        "crease_sharpnesses": np.broadcast_to(sharpness, len(edges)),
    }


def grid_faces(columns: int, rows: int) -> list[list[int]]:
    corners = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    return np.stack([corners, corners + 1, corners + columns + 2, corners + columns + 1], axis=1).tolist()


def grid_points(columns: int, rows: int) -> NDArray[np.float64]:
    y, x = np.mgrid[: rows + 1, : columns + 1]
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1).astype(float)


def wheel(spokes: int, sides: int) -> list[list[int]]:
    """`spokes` faces around vertex 0; vertices 1 … spokes are its neighbours, those across the quads follow."""
    following = [1 + (i + 1) % spokes for i in range(spokes)]
    across = [[1 + spokes + i] if sides == 4 else [] for i in range(spokes)]
    return [[0, 1 + i, *across[i], following[i]] for i in range(spokes)]


def half_wheel(spokes: int, sides: int) -> list[list[int]]:
    """`spokes` faces beside boundary vertex 0."""
    across = [[2 + spokes + i] if sides == 4 else [] for i in range(spokes)]
    return [[0, 1 + i, *across[i], 2 + i] for i in range(spokes)]


def limit_weights(mesh: Topology, level: int) -> Any:
    """(V, control V) where the vertices of a level end, as weights of the control points."""
    refined = refine(mesh, level)
    return limit(refined).position @ refined.vertex.matrix


def row(weights: Any, index: int) -> NDArray[np.float64]:
    return weights[[index]].toarray()[0]


def cube_edges() -> list[tuple[int, int]]:
    return sorted({tuple(sorted(pair)) for face in CUBE_FACES for pair in zip(face, face[1:] + face[:1], strict=True)})


@st.composite
def meshes(draw: st.DrawFn) -> Topology:
    """Meshes with holes torn in, creases, corners and faces that do not fit together."""
    scheme = draw(st.sampled_from(["catmullClark", "bilinear", "loop"]))
    grid = [face for face in grid_faces(3, 3) + CUBE_FACES if draw(st.booleans())] or CUBE_FACES
    cut = [scheme == "loop" or draw(st.booleans()) for _ in grid]
    halves = [[[q[0], q[1], q[2]], [q[0], q[2], q[3]]] for q in grid]
    faces = [
        part for quad, half, is_cut in zip(grid, halves, cut, strict=True) for part in (half if is_cut else [quad])
    ]
    pairs = draw(st.lists(st.tuples(st.integers(0, 15), st.integers(0, 15)), max_size=6))
    sharpness = draw(st.lists(st.floats(-1, 12), min_size=len(pairs), max_size=len(pairs)))
    return topology(
        faces,
        scheme=scheme,
        vertex_count=16,
        interpolate_boundary=draw(st.sampled_from(["none", "edgeOnly", "edgeAndCorner"])),
        triangle_subdivision_rule=draw(st.sampled_from(["catmullClark", "smooth"])),
        corner_indices=[draw(st.integers(0, 15))],
        corner_sharpnesses=[draw(st.floats(0, 12))],
        crease_indices=np.ravel(pairs).astype(int),
        crease_lengths=[2] * len(pairs),
        crease_sharpnesses=sharpness,
    )
