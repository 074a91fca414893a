"""Triangles of faces of any shape: they keep area and winding, and number n − 2."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from defshade_cli.usd.polygons.polygons import Polygons
from defshade_cli.usd.polygons.triangulation import LARGEST_CLIPPED, triangulate

Ring = NDArray[np.float64]

SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
L_SHAPE = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
DART = np.array([[0, 0], [2, 1], [0, 2], [0.5, 1]], float)


def star(radii: Ring) -> Ring:
    angle = np.linspace(0.0, 2.0 * math.pi, len(radii), endpoint=False)
    return np.stack([radii * np.cos(angle), radii * np.sin(angle)], axis=1)


def spiral(size: int, turns: float) -> Ring:
    """A band that winds outwards: inner edge out, outer edge back."""
    angle = np.linspace(1.0, 2.0 * math.pi * turns, size)
    arm = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.concatenate([arm * (angle + 2.0)[:, None], (arm * angle[:, None])[::-1]])


def with_collinear_runs(ring: Ring, inserted: int) -> Ring:
    """Each edge cut into equal parts, which in these coordinates is exact."""
    steps = np.arange(inserted + 1)[None, :, None] / (inserted + 1)
    return (ring[:, None] * (1.0 - steps) + np.roll(ring, -1, axis=0)[:, None] * steps).reshape(-1, 2)


def with_hole(outer: int, inner: int) -> Ring:
    """A disk with a round hole, which a bridge of two coincident edges reaches."""
    rim, hole = star(np.ones(outer)), star(np.full(inner, 0.5))
    return np.concatenate([rim, rim[:1], hole[:1], hole[:0:-1], hole[:1]])


def polygons_of(*rings: Ring, axis: int = 2, mirrored: bool = False) -> Polygons:
    """Plane faces across an axis, one a ring; mirrored ones look along −axis."""
    flat = np.concatenate(rings)
    points = np.insert(flat[:, ::-1] if mirrored else flat, 2, 0.25, axis=1)
    counts = np.array([len(ring) for ring in rings], np.int32)
    return Polygons(
        points=np.roll(points, axis - 2, axis=1).astype(np.float32),
        counts=counts,
        indices=np.arange(len(points), dtype=np.int32),
        faces=np.arange(len(counts), dtype=np.int32),
    )


def signed_areas(polygons: Polygons, axis: int = 2, mirrored: bool = False) -> tuple[Ring, NDArray, list[str]]:
    """Areas of the triangles along the face's side of the axis, their faces, and the issues."""
    issues: list[str] = []
    triangles, face = triangulate(polygons, issues)
    a, b, c = polygons.points[polygons.indices[triangles]].astype(np.float64).swapaxes(0, 1)
    areas = 0.5 * np.cross(b - a, c - a)[:, axis]
    return -areas if mirrored else areas, face, issues


def shoelace(ring: Ring) -> float:
    x, y = ring.astype(np.float32).astype(np.float64).T
    return float(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def assert_cut_right(*rings: Ring, axis: int = 2, mirrored: bool = False) -> None:
    """n − 2 triangles a face, none turned over; so their areas add up to the face's only if none overlap."""
    areas, face, issues = signed_areas(polygons_of(*rings, axis=axis, mirrored=mirrored), axis, mirrored)
    assert not issues
    assert np.bincount(face).tolist() == [len(ring) - 2 for ring in rings]
    wanted = [shoelace(ring) for ring in rings]
    np.testing.assert_allclose(np.bincount(face, areas), wanted, rtol=1e-9)
    np.testing.assert_allclose(np.bincount(face, np.abs(areas)), wanted, rtol=1e-9)


radii = st.lists(st.floats(0.05, 1.0), min_size=5, max_size=40).map(np.array)


@given(st.lists(radii, min_size=1, max_size=6), st.integers(0, 2), st.booleans())
@settings(max_examples=100, deadline=None)
def test_star_shaped_faces_keep_area_and_winding(shapes: list[Ring], axis: int, mirrored: bool) -> None:
    assert_cut_right(*(star(shape) for shape in shapes), axis=axis, mirrored=mirrored)


@given(st.integers(8, 120), st.floats(1.0, 5.0))
@settings(max_examples=30, deadline=None)
def test_spirals_keep_area_and_winding(size: int, turns: float) -> None:
    size = max(size, int(turns * 12))  # fewer would make the arms cross
    assert_cut_right(spiral(size, turns))


@given(st.sampled_from([SQUARE, L_SHAPE, DART]), st.sampled_from([1, 3, 7]), st.integers(0, 20))
@settings(max_examples=40, deadline=None)
def test_collinear_runs_leave_no_gap(ring: Ring, inserted: int, start: int) -> None:
    assert_cut_right(np.roll(with_collinear_runs(ring, inserted), start, axis=0))


@given(st.integers(3, 30), st.integers(3, 30), st.integers(0, 60))
@settings(max_examples=60, deadline=None)
def test_a_hole_behind_a_bridge_stays_open(outer: int, inner: int, start: int) -> None:
    rim, hole = math.cos(math.pi / outer), 0.5
    if rim > hole:  # else the hole reaches through the rim
        assert_cut_right(np.roll(with_hole(outer, inner), start, axis=0))


@given(st.integers(0, 3), st.booleans())
def test_a_concave_quad_is_cut_at_its_reflex_corner(start: int, mirrored: bool) -> None:
    assert_cut_right(np.roll(DART, start, axis=0), mirrored=mirrored)


def test_a_convex_quad_is_cut_from_its_first_corner() -> None:
    triangles, _ = triangulate(polygons_of(SQUARE), [])
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_size_is_of_no_account(scale: float) -> None:
    assert_cut_right(DART * scale, L_SHAPE * scale)


def test_faces_of_mixed_sizes_stay_in_order() -> None:
    rings = [SQUARE, L_SHAPE, SQUARE[:3], DART, star(np.ones(9)), SQUARE]
    assert_cut_right(*rings)
    _, face, _ = signed_areas(polygons_of(*rings))
    assert (np.diff(face) >= 0).all()


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=3, max_size=30))
@settings(max_examples=100, deadline=None)
def test_any_garbage_still_gives_n_minus_2_triangles(points: list[tuple[int, int]]) -> None:
    """Faces that cross themselves, fold back or have no area."""
    polygons = polygons_of(np.array(points, float))
    triangles, _ = triangulate(polygons, [])
    assert len(triangles) == len(points) - 2
    assert ((triangles >= 0) & (triangles < len(points))).all()


def test_a_bent_quad_is_not_folded() -> None:
    """Bent by 60° along either diagonal, both triangles still face the same side."""
    for lifted in range(4):
        points = np.insert(SQUARE, 2, 0.0, axis=1)
        points[lifted, 2] = 0.4
        polygons = Polygons(points.astype(np.float32), np.array([4]), np.arange(4), np.arange(1, dtype=np.int32))
        a, b, c = points[triangulate(polygons, [])[0]].swapaxes(0, 1)
        assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()


def test_a_face_too_large_to_clip_is_said() -> None:
    dented = np.where(np.arange(LARGEST_CLIPPED + 2) % 2, 1.0, 0.5)
    areas, _, issues = signed_areas(polygons_of(star(dented)))
    assert len(areas) == LARGEST_CLIPPED
    assert len(issues) == 1 and str(LARGEST_CLIPPED) in issues[0]


def test_no_faces_give_no_triangles() -> None:
    none = np.empty(0, np.int32)
    triangles, face = triangulate(Polygons(np.empty((0, 3), np.float32), none, none, none), [])
    assert triangles.shape == (0, 3) and face.shape == (0,)
