"""Refinement against hand-worked positions, against itself and against OpenSubdiv."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from cages import (
    CUBE_FACES,
    CUBE_POINTS,
    OCTAHEDRON,
    TETRAHEDRON,
    TWO_BY_TWO,
    creased,
    cube_edges,
    grid_faces,
    meshes,
    row,
    topology,
    wheel,
)
from defshade_cli.usd.subdivision import Topology, limit, refine, refine_face_varying

OPENSUBDIV = Path(__file__).parent / "references" / "subdivision_opensubdiv.npz"


# Catmull–Clark


def test_cube_first_level_by_hand() -> None:
    refined = refine(topology(CUBE_FACES), 1)
    points = refined.vertex @ CUBE_POINTS
    assert_allclose(points[:8], CUBE_POINTS * 5 / 9, atol=1e-15)
    assert_allclose(np.sort(np.abs(points[8:20]), axis=1), [[0, 0.75, 0.75]] * 12, atol=1e-15)
    assert_allclose(np.sort(np.abs(points[20:]), axis=1), [[0, 0, 1]] * 6, atol=1e-15)
    assert_array_equal(refined.face_counts, [4] * 24)
    assert_array_equal(refined.parents, np.repeat(range(6), 4))


def test_cube_second_level_by_hand() -> None:
    """v' = (v + mean of neighbours + mean of face points)/3 = (5/9 + 1/2 + 17/36)/3 on each axis."""
    points = refine(topology(CUBE_FACES), 2).vertex @ CUBE_POINTS
    assert_allclose(points[:8], CUBE_POINTS * 55 / 108, atol=1e-15)


def test_triangles_and_polygons_become_quads() -> None:
    refined = refine(topology([[0, 1, 2], [2, 1, 3, 4, 5]]), 1)
    assert_array_equal(refined.face_counts, [4] * 8)
    assert_array_equal(refined.parents, [0] * 3 + [1] * 5)
    assert_array_equal(refined.face_indices.reshape(-1, 4)[:, 0], [0, 1, 2, 2, 1, 3, 4, 5])


def test_face_point_of_a_pentagon_is_its_centroid() -> None:
    refined = refine(topology([[0, 1, 2, 3, 4]]), 1)
    assert_allclose(row(refined.vertex.matrix, 10), [0.2] * 5, atol=1e-15)


def test_smooth_triangle_rule_weighs_faces_by_47_hundredths() -> None:
    faces = [[0, 1, 2], [1, 0, 3]]
    edge_point = 4
    standard = row(refine(topology(faces), 1).vertex.matrix, edge_point)
    smooth = row(refine(topology(faces, triangle_subdivision_rule="smooth"), 1).vertex.matrix, edge_point)
    assert_allclose(standard, [5 / 12, 5 / 12, 1 / 12, 1 / 12], atol=1e-15)
    assert_allclose(smooth, [0.03 + 0.94 / 3, 0.03 + 0.94 / 3, 0.47 / 3, 0.47 / 3], atol=1e-15)


# Loop


@pytest.mark.parametrize(("faces", "neighbour"), [(TETRAHEDRON, 3 / 16), (OCTAHEDRON, 31 / 256), (wheel(6, 3), 1 / 16)])
def test_loop_vertex_mask(faces: list[list[int]], neighbour: float) -> None:
    weights = row(refine(topology(faces, scheme="loop"), 1).vertex.matrix, 0)
    touching = np.unique([face for face in faces if 0 in face])[1:]
    assert_allclose(weights[touching], neighbour, atol=1e-15)
    assert_allclose(weights[0], 1 - len(touching) * neighbour, atol=1e-15)


def test_loop_edge_mask_on_a_hexagon() -> None:
    refined = refine(topology(wheel(6, 3), scheme="loop"), 1)
    spoke = 7  # the first edge, 0–1, between the triangles to 2 and to 6
    assert_allclose(row(refined.vertex.matrix, spoke), [3 / 8, 3 / 8, 1 / 8, 0, 0, 0, 1 / 8], atol=1e-15)
    assert len(refined.face_counts) == 24
    assert_array_equal(refined.face_counts, 3)


# Creases, corners, boundaries


@pytest.mark.parametrize("level", [1, 3])
def test_an_infinitely_sharp_cube_stays_a_cube(level: int) -> None:
    sharp = refine(topology(CUBE_FACES, **creased(cube_edges(), 10)), level)
    flat = refine(topology(CUBE_FACES, scheme="bilinear"), level)
    assert_allclose(sharp.vertex @ CUBE_POINTS, flat.vertex @ CUBE_POINTS, atol=1e-14)
    assert_allclose(limit(sharp).position @ (sharp.vertex @ CUBE_POINTS), flat.vertex @ CUBE_POINTS, atol=1e-14)


RING = [(0, 1), (1, 3), (3, 2), (2, 0)]


def ringed(sharpness: float, level: int) -> NDArray[np.float64]:
    return refine(topology(CUBE_FACES, **creased(RING, sharpness)), level).vertex.matrix.toarray()


def test_sharpness_below_one_mixes_both_masks() -> None:
    assert_allclose(ringed(0.3, 1), 0.3 * ringed(10, 1) + 0.7 * ringed(0, 1), atol=1e-15)


def test_sharpness_decays_by_one_a_level() -> None:
    assert_allclose(ringed(1.5, 1), ringed(10, 1), atol=1e-15)
    half_sharp = refine(topology(CUBE_FACES, **creased(RING, 1.5)), 1).cage
    assert_array_equal(np.unique(half_sharp.edge_sharpness), [0, 0.5])
    assert np.count_nonzero(half_sharp.edge_sharpness) == 8
    assert_allclose(ringed(2, 2), ringed(10, 2), atol=1e-15)
    assert np.abs(ringed(1.5, 2) - ringed(10, 2)).max() > 0.01


def test_a_vertex_corner_decays_too() -> None:
    sharp = {s: topology(CUBE_FACES, corner_indices=[7], corner_sharpnesses=[s]) for s in (0.0, 0.25, 10.0)}
    weights = {s: row(refine(mesh, 1).vertex.matrix, 7) for s, mesh in sharp.items()}
    assert_allclose(weights[10.0], np.eye(8)[7])
    assert_allclose(weights[0.25], 0.25 * weights[10.0] + 0.75 * weights[0.0], atol=1e-15)


def test_sharpness_is_one_a_crease_or_one_an_edge() -> None:
    chain = {"crease_indices": [0, 1, 2, 4, 5], "crease_lengths": [3, 2]}
    by_crease = topology(TWO_BY_TWO, **chain, crease_sharpnesses=[1, 2])
    by_edge = topology(TWO_BY_TWO, **chain, crease_sharpnesses=[1, 3, 2])
    assert_array_equal(by_crease.crease_edges()[0], [[0, 1], [1, 2], [4, 5]])
    assert_array_equal(by_crease.crease_edges()[1], [1, 1, 2])
    assert_array_equal(by_edge.crease_edges()[1], [1, 3, 2])


def test_creases_that_no_edge_has_are_ignored() -> None:
    stray = refine(topology(CUBE_FACES, **creased([(0, 7)], 10)), 1)
    assert_allclose(stray.vertex.matrix.toarray(), refine(topology(CUBE_FACES), 1).vertex.matrix.toarray())


def test_boundary_corners() -> None:
    """A single quad keeps its corners under edgeAndCorner; edgeOnly rounds them by the B-spline (6, 1, 1)/8."""
    pinned, rounded = (
        refine(topology([[0, 1, 2, 3]], interpolate_boundary=rule), 1).vertex.matrix[:4].toarray()
        for rule in ("edgeAndCorner", "edgeOnly")
    )
    assert_allclose(pinned, np.eye(4))
    assert_allclose(rounded[0], [6 / 8, 1 / 8, 0, 1 / 8])


def test_boundary_none_leaves_the_faces_inside() -> None:
    refined = refine(topology(grid_faces(3, 3), interpolate_boundary="none"), 1)
    assert_array_equal(np.unique(refined.parents[~refined.holes]), [4])
    assert not refine(topology(grid_faces(3, 3), interpolate_boundary="edgeOnly"), 1).holes.any()


def test_boundary_none_keeps_faces_behind_sharp_creases() -> None:
    outline = [(0, 1), (1, 2), (2, 5), (5, 8), (8, 7), (7, 6), (6, 3), (3, 0)]
    mesh = topology(TWO_BY_TWO, interpolate_boundary="none", **creased(outline, 10))
    assert not refine(mesh, 1).holes.any()


def test_holes_shape_the_surface_and_are_flagged() -> None:
    whole, holed = refine(topology(CUBE_FACES), 2), refine(topology(CUBE_FACES, holes=[2]), 2)
    assert_allclose(holed.vertex.matrix.toarray(), whole.vertex.matrix.toarray())
    assert_array_equal(holed.holes, holed.parents == 2)


def test_a_fin_is_infinitely_sharp_where_it_joins() -> None:
    faces = [*TWO_BY_TWO, [4, 1, 9, 10]]
    weights = refine(topology(faces), 1).vertex.matrix.toarray()
    assert_allclose(weights.sum(axis=1), 1)
    joint = np.flatnonzero((weights[:, 1] == 0.5) & (weights[:, 4] == 0.5))
    assert len(joint) == 1
    assert_allclose(weights[4], np.eye(11)[4])


def test_faces_wound_against_each_other_part_sharply() -> None:
    against = refine(topology([[0, 1, 2, 3], [1, 2, 5, 4]], vertex_count=6), 1).vertex.matrix.toarray()
    assert_allclose(against[1], np.eye(6)[1])
    assert_allclose(against.sum(axis=1), 1)


# Every mesh


@settings(max_examples=60, deadline=None)
@given(meshes(), st.integers(0, 2))
def test_stencils_are_affine_combinations(mesh: Topology, level: int) -> None:
    refined = refine(mesh, level)
    surface = limit(refined)
    uv, corners = refine_face_varying(mesh, mesh.face_indices, mesh.vertex_count, "cornersPlus1", level)
    for weights in (refined.vertex.matrix, refined.varying.matrix, surface.position, uv.matrix):
        assert_allclose(weights.sum(axis=1), 1, atol=1e-12)
    for tangent in (surface.tangent1, surface.tangent2):
        assert_allclose(tangent.sum(axis=1), 0, atol=1e-12)
    assert len(corners) == len(refined.face_indices) == len(surface.sectors)
    assert_array_equal(surface.vertices[surface.sectors], refined.face_indices)


@pytest.mark.parametrize("case", sorted({key.split("/")[0] for key in np.load(OPENSUBDIV)}))
def test_agrees_with_opensubdiv(case: str) -> None:
    """Random meshes with creases, corners, holes and seams; expected values computed by OpenSubdiv 3.5.0 in float64.

    Its masks and the stored values are float32, hence 1e-5 for points of size 1 to 3.
    """
    data = {key.split("/")[1]: value for key, value in np.load(OPENSUBDIV).items() if key.startswith(f"{case}/")}
    scheme, rule = case.split("_")
    boundary, triangles = data["options"]
    given_arrays = {key: data[key] for key in data if key.startswith(("face_c", "face_i", "holes", "crease", "corner"))}
    mesh = Topology(
        **given_arrays,
        vertex_count=len(data["points"]),
        scheme=scheme,
        interpolate_boundary=str(boundary),
        triangle_subdivision_rule=str(triangles),
    )
    level, values = int(data["level"]), (data["value_indices"], len(data["values"]))
    refined = refine(mesh, level)
    used = np.unique(refined.face_indices)
    points = refined.vertex @ data["points"]
    assert_allclose(points, data["refined"], atol=1e-5)
    assert_allclose(refined.varying @ data["points"], data["varying"], atol=1e-5)
    assert_allclose((limit(refined).position @ points)[used], data["limit"][used], atol=1e-5)
    assert_array_equal(refined.holes[refined.cage.face], data["hole"])
    uv, corners = refine_face_varying(mesh, *values, rule, level)
    assert_allclose((uv @ data["values"])[corners], data["face_varying"], atol=1e-5)
    if scheme != "bilinear":  # whose limit values OpenSubdiv smooths along seams, against its refined ones
        uv, corners = refine_face_varying(mesh, *values, rule, level, at_limit=True)
        assert_allclose((uv @ data["values"])[corners], data["face_varying_limit"], atol=1e-5)


# What is refused


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"face_counts": [], "face_indices": []}, "no faces"),
        ({"face_counts": [4, 2]}, "face 1 has 2 vertices"),
        ({"face_counts": [4, 4]}, "need 8 vertex indices, got 4"),
        ({"face_indices": [0, 1, 2, 4]}, "face index 4 is outside the 4 points"),
        ({"face_indices": [0, 1, 2, -1]}, "face index -1"),
        ({"scheme": "loop"}, "triangles only; face 0 has 4"),
        ({"scheme": "none"}, "scheme is 'none'"),
        ({"interpolate_boundary": "edges"}, "not one of none, edgeOnly, edgeAndCorner"),
        ({"holes": [1]}, "hole index 1 is outside the 1 faces"),
        ({"crease_indices": [0], "crease_lengths": [1], "crease_sharpnesses": [1]}, "fewer than two"),
        ({"crease_indices": [0, 1, 2], "crease_lengths": [2], "crease_sharpnesses": [1]}, "need 2 vertex indices"),
        ({"crease_indices": [0, 1, 2], "crease_lengths": [3], "crease_sharpnesses": [1] * 3}, "3 sharpnesses for 1"),
        ({"crease_indices": [0, 9], "crease_lengths": [2], "crease_sharpnesses": [1]}, "crease index 9"),
        ({"crease_indices": [0, 1], "crease_lengths": [2], "crease_sharpnesses": [np.nan]}, "not a number"),
        ({"corner_indices": [0], "corner_sharpnesses": []}, "0 sharpnesses for 1 corners"),
        ({"corner_indices": [4], "corner_sharpnesses": [1]}, "corner index 4"),
    ],
)
def test_bad_topology_says_why(options: dict[str, Any], reason: str) -> None:
    quad = {"face_counts": [4], "face_indices": [0, 1, 2, 3], "vertex_count": 4}
    with pytest.raises(ValueError, match=reason):
        Topology(**(quad | options))
