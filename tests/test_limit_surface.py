"""Limit positions, tangents and normals against closed forms and against further refinement."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cages import (
    CUBE_FACES,
    CUBE_POINTS,
    OCTAHEDRON,
    PYRAMID,
    TETRAHEDRON,
    creased,
    cube_edges,
    grid_faces,
    grid_points,
    half_wheel,
    limit_weights,
    row,
    topology,
    wheel,
)
from defshade_cli.usd.subdivision import Topology, limit, refine


@pytest.mark.parametrize("valence", [2, 3, 4, 5, 6, 9])
def test_smooth_limit_mask(valence: int) -> None:
    """Halstead, Kass and DeRose 1993: n², 4, 1 over n (n + 5)."""
    position = row(limit_weights(topology(wheel(valence, 4)), 0), 0)
    expected = np.repeat([valence**2, 4, 1], [1, valence, valence]) / (valence * (valence + 5))
    assert_allclose(position, expected, atol=1e-15)


@pytest.mark.parametrize("valence", [3, 4, 5, 6, 8])
def test_loop_limit_mask(valence: int) -> None:
    beta = (5 / 8 - (3 / 8 + np.cos(2 * np.pi / valence) / 4) ** 2) / valence
    position = row(limit_weights(topology(wheel(valence, 3), scheme="loop"), 0), 0)
    assert_allclose(position[1:], 1 / (valence + 3 / (8 * beta)), atol=1e-15)
    assert_allclose(position.sum(), 1, atol=1e-15)


def test_regular_loop_limit_is_the_box_spline() -> None:
    position = row(limit_weights(topology(wheel(6, 3), scheme="loop"), 0), 0)
    assert_allclose(position, [1 / 2] + [1 / 12] * 6, atol=1e-15)


SMOOTH_MESHES = [
    topology(CUBE_FACES),
    topology(PYRAMID),
    topology(wheel(5, 4), interpolate_boundary="edgeOnly"),
    topology(CUBE_FACES, **creased([(0, 1), (1, 3), (3, 2), (2, 0)], 10)),
    topology(CUBE_FACES[1:]),
    topology(OCTAHEDRON, scheme="loop"),
    topology(TETRAHEDRON[1:], scheme="loop", interpolate_boundary="edgeOnly"),
    topology(OCTAHEDRON, scheme="loop", **creased([(0, 2), (2, 1), (1, 3), (3, 0)], 10)),
    topology([[0, 1, 2, 3], [0, 3, 2, 1]]),
]


@pytest.mark.parametrize("mesh", SMOOTH_MESHES)
def test_limit_is_the_same_from_every_level(mesh: Topology) -> None:
    limits = [limit_weights(mesh, level)[: mesh.vertex_count].toarray() for level in (0, 1, 3)]
    assert_allclose(limits[0], limits[1], atol=1e-12)
    assert_allclose(limits[1], limits[2], atol=1e-12)


@pytest.mark.parametrize("mesh", SMOOTH_MESHES[:2] + SMOOTH_MESHES[5:6])
def test_refinement_converges_to_the_limit(mesh: Topology) -> None:
    """At least by the square of the subdominant eigenvalue a level, .41² for three neighbours under Catmull–Clark."""
    exact = limit_weights(mesh, 0)
    errors = [abs(refine(mesh, level).vertex.matrix[: mesh.vertex_count] - exact).max() for level in (2, 5)]
    assert errors[1] < errors[0] * 0.4**3
    assert errors[1] < 2e-3


@pytest.mark.parametrize("scheme", ["catmullClark", "loop"])
@pytest.mark.parametrize(
    ("shape", "count"), [(wheel, n) for n in (3, 4, 5, 6, 9)] + [(half_wheel, n) for n in (1, 2, 3, 4, 5, 7)]
)
def test_tangents_are_eigenvectors(scheme: Any, shape: Any, count: int) -> None:
    """A tangent mask applied one level finer is the same mask, shorter: t S = λ t."""
    mesh = topology(shape(count, 3 if scheme == "loop" else 4), scheme=scheme, interpolate_boundary="edgeOnly")
    control, refined = refine(mesh, 0), refine(mesh, 1)
    coarse, fine = limit(control), limit(refined)
    for name in ("tangent1", "tangent2"):
        before = row(getattr(coarse, name), 0)
        after = row(getattr(fine, name) @ refined.vertex.matrix, 0)
        shrunk = np.abs(after).max() / np.abs(before).max()
        assert 0.2 < shrunk < 0.9
        assert_allclose(after, before * shrunk, atol=1e-14)
        assert_allclose(before.sum(), 0, atol=1e-14)


def test_normals_of_a_flat_grid_are_straight_everywhere() -> None:
    for level in (0, 2):
        refined = refine(topology(grid_faces(4, 3)), level)
        normals = limit(refined).normals(refined.vertex @ grid_points(4, 3))
        assert_allclose(normals, np.broadcast_to([0, 0, 1], normals.shape), atol=1e-12)


def test_normals_of_a_tube_are_its_radii() -> None:
    """Around a regular tube the limit curve is a closed uniform B-spline whose normal passes through the axis."""
    around, along = 12, 5
    a, z = np.meshgrid(np.arange(around), np.arange(along), indexing="ij")
    angle = 2 * np.pi * a.ravel() / around
    points = np.stack([np.cos(angle), np.sin(angle), z.ravel()], axis=1)
    k = np.arange(around)[:, None] * along + np.arange(along - 1)
    right = (k + along) % (around * along)
    faces = np.stack([k, right, right + 1, k + 1], axis=-1).reshape(-1, 4).tolist()
    refined = refine(topology(faces), 1)
    surface, points = limit(refined), refined.vertex @ points
    positions = (surface.position @ points)[surface.vertices] * [1, 1, 0]
    radii = positions / np.linalg.norm(positions, axis=1, keepdims=True)
    assert_allclose(surface.normals(points), radii, atol=1e-12)


def test_normals_are_continuous_but_across_creases() -> None:
    refined = refine(topology(CUBE_FACES, **creased(cube_edges(), 10)), 2)
    smooth, sharp = limit(refine(topology(CUBE_FACES), 2)), limit(refined)
    assert len(smooth.vertices) == 98
    assert_array_equal(np.bincount(sharp.vertices)[:9], [3] * 8 + [2])
    facing = np.abs(sharp.normals(refined.vertex @ CUBE_POINTS))
    assert_allclose(np.sort(facing, axis=1), [[0, 0, 1]] * len(facing), atol=1e-12)


def test_bilinear_normals_are_those_of_each_face() -> None:
    refined = refine(topology(CUBE_FACES, scheme="bilinear"), 1)
    surface = limit(refined)
    normals = surface.normals(refined.vertex @ CUBE_POINTS)[surface.sectors].reshape(6, 16, 3)
    assert_allclose(normals, np.broadcast_to(normals[:, :1], normals.shape), atol=1e-15)
    assert_allclose((normals[:, 0] * [CUBE_POINTS[face].mean(axis=0) for face in CUBE_FACES]).sum(axis=1), 1)


def test_a_crease_is_a_cubic_b_spline() -> None:
    """Knots at (1, 4, 1)/6 of the control points, the middles between them at (1, 23, 23, 1)/48."""
    mesh = topology(grid_faces(5, 2), **creased([(i, i + 1) for i in range(6, 11)], 10))
    refined = refine(mesh, 1)
    position = limit_weights(mesh, 1)
    halves = refined.vertex.matrix[:, [8, 9]].toarray() == 0.5
    middle = int(np.flatnonzero(halves.all(axis=1))[0])
    assert_allclose(row(position, 8)[6:12], np.array([0, 1, 4, 1, 0, 0]) / 6, atol=1e-15)
    assert_allclose(row(position, middle)[6:12], np.array([0, 1, 23, 23, 1, 0]) / 48, atol=1e-15)
    assert_allclose(row(position, 8).sum(), 1, atol=1e-15)


def test_semi_sharp_limit_is_exact_once_the_crease_has_decayed() -> None:
    mesh = topology(CUBE_FACES, **creased([(0, 1), (1, 3), (3, 2), (2, 0)], 1.5))
    early, late = (limit_weights(mesh, level)[:8].toarray() for level in (2, 4))
    assert_allclose(early, late, atol=1e-12)


def test_a_dart_is_nearly_exact() -> None:
    """The end of an infinitely sharp crease inside takes the smooth mask, as in OpenSubdiv; its true limit is near."""
    mesh = topology(grid_faces(6, 6), **creased([(21, 22), (22, 23), (23, 24)], 10))
    bump = np.exp(-((grid_points(6, 6)[:, :2] - 3) ** 2).sum(axis=1))
    early, late = (row(limit_weights(mesh, level), 24) @ bump for level in (0, 4))
    assert 1e-6 < abs(early - late) < 0.02
