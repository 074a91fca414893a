"""Light volumes hold what they must: nothing lit is ever outside."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from defshade_cli.passes.volumes import CONE_SIDES, cone_volume, sphere_volume


def is_inside(corners: NDArray, triangles: NDArray, points: NDArray) -> NDArray[np.bool_]:
    """Which points (P, 3) lie within every face's plane of a convex mesh wound outwards."""
    a, b, c = corners.astype(np.float64)[triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    sound = np.linalg.norm(normal, axis=1) > 1e-12
    offset = np.einsum("ni,ni->n", normal, a)
    return ((points @ normal[sound].T) <= offset[sound] + 1e-6).all(axis=1)


def cone_corners(angle: float) -> tuple[NDArray, NDArray]:
    """light_cone.vert in NumPy: axis +Z, reach 1."""
    corners, triangles = cone_volume()
    length = np.linalg.norm(corners[:, :2], axis=1)
    polar = np.arctan2(np.sin(angle) / math.cos(math.pi / CONE_SIDES), np.cos(angle)) * length
    azimuth = np.divide(corners[:, :2], length[:, None], out=np.zeros((len(corners), 2)), where=length[:, None] > 0)
    return np.column_stack([np.sin(polar)[:, None] * azimuth, np.cos(polar)]) * corners[:, 2:], triangles


def directions(count: int, least_cosine: float) -> NDArray:
    """Unit vectors around +Z with a cosine of at least that."""
    random = np.random.default_rng(7)
    z = random.uniform(least_cosine, 1.0, count)
    phi = random.uniform(0.0, 2 * math.pi, count)
    return np.column_stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z])


def test_the_sphere_volume_holds_the_unit_sphere_and_little_more() -> None:
    corners, triangles = sphere_volume()
    assert is_inside(corners, triangles, directions(4000, -1.0)).all()
    assert np.linalg.norm(corners, axis=1).max() < 1.08


def test_the_sphere_volume_is_closed_and_wound_outwards() -> None:
    corners, triangles = sphere_volume()
    a, b, c = corners.astype(np.float64)[triangles].transpose(1, 0, 2)
    volume = np.einsum("ni,ni->", a, np.cross(b, c)) / 6
    assert volume > 4 / 3 * math.pi
    edges = {tuple(e) for e in triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)}
    assert all((j, i) in edges for i, j in edges)


@given(st.floats(0.5, 90.0))
def test_the_cone_volume_holds_its_cone(degrees: float) -> None:
    angle = math.radians(degrees)
    corners, triangles = cone_corners(angle)
    points = directions(500, math.cos(angle)) * np.random.default_rng(3).uniform(0, 1, (500, 1)) ** (1 / 3)
    assert is_inside(corners, triangles, points).all()


@pytest.mark.parametrize("degrees", [1.0, 30.0, 60.0])
def test_the_cone_volume_is_tight(degrees: float) -> None:
    corners, _ = cone_corners(math.radians(degrees))
    polar = np.degrees(np.arctan2(np.linalg.norm(corners[1:, :2], axis=1), corners[1:, 2]))
    assert polar.max() < degrees * 1.006
    assert np.linalg.norm(corners, axis=1).max() < 1.03


def test_the_shader_circumscribes_the_same_polygon() -> None:
    from defshade_cli.resources import SHADERS

    text = (SHADERS / "light_cone.vert").read_text()
    literal = float(text.split("CIRCUMSCRIBED = ")[1].split(";")[0])
    assert literal == pytest.approx(1 / math.cos(math.pi / CONE_SIDES), rel=1e-7)
    assert literal >= 1 / math.cos(math.pi / CONE_SIDES) - 1e-9
