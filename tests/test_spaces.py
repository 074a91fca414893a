"""Frames and windows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defshade_cli.scene.camera import Camera
from defshade_cli.spaces import conform_window, normalize, rigid, transform_points, translation

ratios = st.floats(0.05, 20.0)


@given(ratios, ratios)
def test_expand_aperture_keeps_all_of_the_window(window_aspect: float, image_aspect: float) -> None:
    left, right, bottom, top = conform_window((-window_aspect, window_aspect, -1.0, 1.0), image_aspect)
    assert (right - left) / (top - bottom) == pytest.approx(image_aspect)
    assert right >= window_aspect * (1 - 1e-12) and top >= 1.0 - 1e-12


@given(ratios, ratios)
def test_crop_aperture_shows_nothing_outside_the_window(window_aspect: float, image_aspect: float) -> None:
    left, right, bottom, top = conform_window((-window_aspect, window_aspect, -1.0, 1.0), image_aspect, "cropAperture")
    assert (right - left) / (top - bottom) == pytest.approx(image_aspect)
    assert right <= window_aspect * (1 + 1e-12) and top <= 1.0 + 1e-12


def test_conforming_keeps_the_aperture_offset() -> None:
    left, right, bottom, top = conform_window((0.0, 2.0, 1.0, 2.0), 4.0)
    assert (left + right) / 2 == pytest.approx(1.0)
    assert (bottom, top) == (1.0, 2.0)


def test_rigid_drops_scale_and_keeps_place() -> None:
    matrix = translation(np.array([1.0, 2.0, 3.0])) @ np.diag([2.0, 3.0, 0.5, 1.0])
    result = rigid(matrix)
    np.testing.assert_allclose(result[:3, :3] @ result[:3, :3].T, np.eye(3), atol=1e-14)
    np.testing.assert_array_equal(result[:3, 3], [1.0, 2.0, 3.0])


def test_rigid_of_a_mirrored_matrix_is_a_rotation() -> None:
    assert np.linalg.det(rigid(np.diag([-1.0, 1.0, 1.0, 1.0]))[:3, :3]) == pytest.approx(1.0)


def test_camera_from_world_inverts_world_from_camera() -> None:
    angle = 0.7
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, 3] = [1e7, -2.0, 3.0]
    camera = Camera("/camera", matrix, (-1.0, 1.0, -1.0, 1.0))
    points = np.array([[1.0, 2.0, 3.0], [-4.0, 5.0, -6.0]])
    there_and_back = transform_points(camera.camera_from_world, transform_points(matrix, points))
    np.testing.assert_allclose(there_and_back, points, atol=1e-8)  # 1e7 in float64 leaves 2e-9


def test_a_zero_vector_stays_zero() -> None:
    np.testing.assert_array_equal(normalize(np.zeros((2, 3))), np.zeros((2, 3)))
