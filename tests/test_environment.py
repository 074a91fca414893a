"""Skies: sampled without bias, and their irradiance in spherical harmonics."""

import logging
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from defshade_cli.image.environment import sky_of
from defshade_cli.passes.sampling import owen_sobol
from defshade_cli.scene.distribution import GridDistribution
from defshade_cli.scene.environment import Environment, harmonics, uniform_environment
from defshade_cli.scene.light import DomeLight
from defshade_cli.scene.texture import ImageFile


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
    assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-12)
    assert_allclose(weights.mean(0), 4 * math.pi, rtol=2e-3)
    expected = 0.0 if np.ptp(sky.radiance) == 0.0 else 4 * math.pi / 3
    assert_allclose((weights * directions[:, 1:2]).mean(0), expected, rtol=1e-2, atol=0.05)


def test_directions_by_any_density_have_the_same_mean() -> None:
    sky = Environment(np.random.default_rng(1).random((8, 16, 3)))
    density = GridDistribution((np.random.default_rng(2).random((8, 16)) + 0.1).repeat(2, 0).repeat(2, 1))
    drawn = [[sky.sample(owen_sobol(i, 3), by)[1] for i in range(4096)] for by in (None, density)]
    assert_allclose(np.mean(drawn[0], axis=0), np.mean(drawn[1], axis=0), rtol=5e-3)


def test_cells_hold_the_directions_that_are_drawn_from_them() -> None:
    sky = Environment(np.random.default_rng(3).random((8, 16, 1)).repeat(3, axis=2))
    directions, radiance, extents = zip(*(sky.sample(owen_sobol(i, 5)) for i in range(64)), strict=True)
    cells = sky.cell_of(np.array(directions))
    assert_allclose(sky.luminance[cells], np.array(radiance)[:, 0] / extents, rtol=1e-6)
    assert_allclose(sky.density()[cells], 1.0 / np.array(extents), rtol=1e-6)


def test_cells_are_of_the_sky_as_it_is_interpolated() -> None:
    """A bright pixel is a tent over its neighbours, in halves of pixels; from column to column around the sky."""
    radiance = np.zeros((8, 16, 3), np.float32)
    radiance[4, 0] = 16.0
    tent = np.array([1.0, 3.0, 3.0, 1.0])
    around = Environment(radiance).luminance[7:11][:, [-1, 0, 1, 2]]
    assert_allclose(around, np.outer(tent, tent), rtol=1e-6)


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
    assert_allclose(irradiance, np.repeat(expected[:, None], 3, axis=1), rtol=2e-3)


def test_harmonics_are_orthonormal() -> None:
    rng = np.random.default_rng(1)
    d = rng.normal(size=(200_000, 3))
    y = harmonics(d / np.linalg.norm(d, axis=1, keepdims=True))
    assert_allclose(4 * math.pi * (y.T @ y) / len(d), np.eye(9), atol=0.02)  # 1/√200000 of noise, times 4π


@pytest.mark.parametrize("shape", [(1, 1), (1, 4), (3, 2), (64, 128)])
def test_a_coarse_even_sky_lights_alike_from_all_sides(shape: tuple[int, int]) -> None:
    """Irradiance π on every surface, of which only the first harmonic is not zero."""
    sky = Environment(np.ones((*shape, 3), np.float32))
    even = np.zeros((9, 3))
    even[0] = 2.0 * math.pi**1.5
    assert_allclose(sky.irradiance_sh, even, atol=2e-3)


def test_balanced_directions_have_the_harmonics_of_their_sky() -> None:
    """However few; a diffuse surface sees little else of the sky."""
    rng = np.random.default_rng(3)
    sky = Environment(rng.random((16, 32, 3), np.float32) ** 8)
    drawn = [sky.sample(tuple(u)) for u in rng.random((64, 2))]
    directions, radiance = (np.array([sample[k] for sample in drawn]) for k in (0, 1))
    factor = 1.0 + harmonics(directions) @ sky.balance(directions, radiance)
    moments = harmonics(directions).T @ (factor * radiance) / len(drawn)
    cosine = np.array([np.pi, *[2.0 * np.pi / 3.0] * 3, *[np.pi / 4.0] * 5])
    assert_allclose(cosine[:, None] * moments, sky.irradiance_sh, atol=1e-9)


def test_an_image_that_cannot_be_read_is_an_even_sky_and_said_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """In one line, whatever the library says."""
    file = tmp_path / "sky.png"
    file.write_bytes(b"\x89PNG\r\n\x1a\n but no more")
    dome = DomeLight(path="/sky", world_from_light=np.eye(4), color=np.ones(3), texture=ImageFile(str(file)))
    with caplog.at_level(logging.WARNING):
        assert sky_of(dome) is sky_of(dome)
    (told,) = caplog.messages
    assert told.startswith(f"/sky: {file} cannot be read: ") and "\n" not in told
    assert np.ptp(sky_of(dome).radiance) == 0.0
