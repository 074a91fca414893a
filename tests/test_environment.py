"""Skies: sampled without bias, and their irradiance in spherical harmonics."""

import math

import numpy as np
import pytest

from defshade_cli.scene.environment import Environment, harmonics, uniform_environment


def gradient_sky(height: int = 64) -> Environment:
    """Radiance 1 + y: irradiance on a normal n is π (1 + 2/3 n_y)."""
    latitude = math.pi * (0.5 - (np.arange(height) + 0.5) / height)
    return Environment(np.repeat((1 + np.sin(latitude))[:, None, None], 2 * height, axis=1) * np.ones(3))


def drawn(sky: Environment, count: int = 64) -> tuple[np.ndarray, np.ndarray]:
    grid = (np.arange(count) + 0.5) / count
    pairs = [sky.sample((u, v)) for u in grid for v in grid]
    return np.array([d for d, *_ in pairs]), np.array([w for _, w, _ in pairs])


@pytest.mark.parametrize("sky", [uniform_environment(), gradient_sky(), gradient_sky(300)])
def test_the_mean_of_samples_is_the_integral(sky: Environment) -> None:
    """∫ L dω = 4π for both, and ∫ L y dω = 4π/3 for the gradient."""
    directions, weights = drawn(sky)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(weights.mean(0), 4 * math.pi, rtol=2e-3)
    expected = 0.0 if len(sky.radiance) == 8 else 4 * math.pi / 3
    np.testing.assert_allclose((weights * directions[:, 1:2]).mean(0), expected, rtol=1e-2, atol=0.05)


def test_a_sun_is_found_where_it_stands() -> None:
    """OpenEXR's layout: a quarter from the left is +X, the centre +Z, the top +Y."""
    for column, row, axis in ((16, 32, [1, 0, 0]), (32, 32, [0, 0, 1]), (48, 32, [-1, 0, 0]), (10, 0, [0, 1, 0])):
        radiance = np.zeros((64, 64, 3), np.float32)
        radiance[max(row - 1, 0) : row + 1, column - 1 : column + 1] = 100.0
        directions, _ = drawn(Environment(radiance), 8)
        assert (directions @ axis).min() > math.cos(math.radians(8.5))


def test_a_black_sky_gives_nothing() -> None:
    _, weights = drawn(Environment(np.zeros((16, 32, 3), np.float32)), 4)
    assert not weights.any()


def test_irradiance_of_a_gradient_is_exact() -> None:
    """Degree 1 is within the nine harmonics; the rest is the grid's: 64 rows."""
    normals = np.array([[0, 1, 0], [0, -1, 0], [1, 0, 0], [0.6, 0.8, 0]], np.float64)
    irradiance = harmonics(normals) @ gradient_sky().irradiance_sh
    expected = math.pi * (1 + 2 / 3 * normals[:, 1])
    np.testing.assert_allclose(irradiance, np.repeat(expected[:, None], 3, axis=1), rtol=2e-3)


def test_harmonics_are_orthonormal() -> None:
    rng = np.random.default_rng(1)
    d = rng.normal(size=(200_000, 3))
    y = harmonics(d / np.linalg.norm(d, axis=1, keepdims=True))
    np.testing.assert_allclose(4 * math.pi * (y.T @ y) / len(d), np.eye(9), atol=0.02)  # 1/√200000 of noise, times 4π
