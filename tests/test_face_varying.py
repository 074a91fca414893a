"""Face-varying primvars: what each rule pins, what it smooths."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from cages import CUBE_FACES, TWO_BY_TWO, grid_faces, grid_points, limit_weights, meshes, row, topology
from defshade_cli.usd.subdivision import Topology, refine, refine_face_varying


@settings(max_examples=40, deadline=None)
@given(meshes(), st.sampled_from(["none", "cornersOnly", "cornersPlus1", "cornersPlus2"]))
def test_a_primvar_without_seams_refines_like_the_points(mesh: Topology, rule: Any) -> None:
    mesh = dataclasses.replace(mesh, interpolate_boundary="edgeAndCorner")
    refined = refine(mesh, 2)
    for wanted, is_limit in ((refined.vertex.matrix, False), (limit_weights(mesh, 2), True)):
        uv, corners = refine_face_varying(mesh, mesh.face_indices, mesh.vertex_count, rule, 2, is_limit)
        assert abs(uv.matrix[corners] - wanted[refined.face_indices]).max() < 1e-14


def pinned_at_centre(groups: list[int], rule: Any) -> list[bool]:
    """For each face of a 2×2 grid, whether its value at the centre stays; faces of one group share their values."""
    mesh = topology(TWO_BY_TWO)
    keys = mesh.face_indices * 10 + np.repeat(groups, 4)
    found, indices = np.unique(keys, return_inverse=True)
    stencils, refined = refine_face_varying(mesh, indices, len(found), rule, 1)
    at_centre = np.flatnonzero(refine(mesh, 1).face_indices == 4)
    return (stencils.matrix[refined[at_centre]].max(axis=1).toarray().ravel() == 1).tolist()


STRAIGHT, CONCAVE, JUNCTION = [0, 0, 1, 1], [0, 0, 0, 1], [0, 0, 1, 2]


@pytest.mark.parametrize(
    ("groups", "rule", "pinned"),
    [
        (STRAIGHT, "none", [0, 0, 0, 0]),
        (STRAIGHT, "cornersOnly", [0, 0, 0, 0]),
        (STRAIGHT, "cornersPlus1", [0, 0, 0, 0]),
        (STRAIGHT, "cornersPlus2", [0, 0, 0, 0]),
        (STRAIGHT, "boundaries", [1, 1, 1, 1]),
        (STRAIGHT, "all", [1, 1, 1, 1]),
        (CONCAVE, "none", [0, 0, 0, 0]),
        (CONCAVE, "cornersOnly", [0, 0, 0, 1]),
        (CONCAVE, "cornersPlus1", [0, 0, 0, 1]),
        (CONCAVE, "cornersPlus2", [1, 1, 1, 1]),
        (JUNCTION, "none", [0, 0, 0, 0]),
        (JUNCTION, "cornersOnly", [0, 0, 1, 1]),
        (JUNCTION, "cornersPlus1", [1, 1, 1, 1]),
    ],
)
def test_what_each_rule_pins_at_a_seam(groups: list[int], rule: str, pinned: list[int]) -> None:
    """OpenSubdiv, "Face-varying interpolation rules": corners, junctions of three regions, concave corners."""
    assert pinned_at_centre(groups, rule) == [bool(p) for p in pinned]


@pytest.mark.parametrize(("rule", "pinned"), [("cornersOnly", False), ("cornersPlus1", False), ("cornersPlus2", True)])
def test_the_end_of_a_seam_inside(rule: Any, pinned: bool) -> None:
    """A dart: the edge from the centre to vertex 1 has two values at vertex 1 only."""
    indices = np.ravel(TWO_BY_TWO).copy()
    indices[4] = 9
    stencils, refined = refine_face_varying(topology(TWO_BY_TWO), indices, 10, rule, 1)
    at_centre = refined[refine(topology(TWO_BY_TWO), 1).face_indices == 4]
    weights = row(stencils.matrix, int(at_centre[0]))
    assert_allclose(weights[[4, 1, 9]], [1, 0, 0] if pinned else [6 / 8, 1 / 8, 1 / 8], atol=1e-15)


def test_a_strip_with_a_seam() -> None:
    """Two quads that share no value: every value is a corner, pinned by all rules but none, which rounds it."""
    mesh = topology([[0, 1, 4, 3], [1, 2, 5, 4]])
    pinned, _ = refine_face_varying(mesh, np.arange(8), 8, "cornersOnly", 1)
    rounded, _ = refine_face_varying(topology([[0, 1, 4, 3], [1, 2, 5, 4]]), np.arange(8), 8, "none", 1)
    own = pinned.matrix.toarray()[:8]
    assert_allclose(np.sort(own, axis=1)[:, -1], 1)
    inner = row(rounded.matrix, int(np.flatnonzero(own[:, 1])[0]))
    assert_allclose(inner, [1 / 8, 6 / 8, 1 / 8, 0, 0, 0, 0, 0], atol=1e-15)


def test_seam_middles_stay_apart() -> None:
    mesh = topology([[0, 1, 4, 3], [1, 2, 5, 4]])
    stencils, refined = refine_face_varying(mesh, np.arange(8), 8, "cornersPlus1", 1)
    on_seam = refined[refine(mesh, 1).face_indices == refine(mesh, 1).face_indices[1]]
    assert len(np.unique(refined)) == stencils.matrix.shape[0] == 18
    assert_allclose(stencils.matrix[on_seam].max(axis=1).toarray(), 0.5)


def test_linear_everywhere_is_varying() -> None:
    mesh = topology(CUBE_FACES)
    stencils, refined = refine_face_varying(mesh, mesh.face_indices, 8, "all", 2)
    expected = refine(mesh, 2)
    assert abs(stencils.matrix[refined] - expected.varying.matrix[expected.face_indices]).max() < 1e-15


def test_linear_boundaries_keep_the_outline() -> None:
    mesh = topology(grid_faces(3, 3), interpolate_boundary="edgeOnly")
    uv = grid_points(3, 3)[:, :2] ** 2
    stencils, refined = refine_face_varying(mesh, mesh.face_indices, 16, "boundaries", 2)
    flat = refine_face_varying(mesh, mesh.face_indices, 16, "all", 2)[0]
    outline = np.unique(refined[np.isin(refined, np.flatnonzero((flat @ uv == 0).any(axis=1)))])
    assert len(outline) == 25
    assert_allclose((stencils @ uv)[outline], (flat @ uv)[outline], atol=1e-15)


@pytest.mark.parametrize(
    ("indices", "rule", "reason"),
    [
        ([0, 1, 2], "none", "3 face-varying indices for 4"),
        ([0, 1, 2, 4], "none", "outside the 4"),
        ([0] * 4, "x", "rule"),
    ],
)
def test_bad_primvars_say_why(indices: list[int], rule: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        refine_face_varying(topology([[0, 1, 2, 3]]), indices, 4, rule, 1)
