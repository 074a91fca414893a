"""Where samples lie."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats.qmc import discrepancy

from defshade_cli.passes.lattices import even_grid, spiral
from defshade_cli.passes.sampling import CENTRE, owen_sobol, owen_sobol_3d, samples


def test_a_single_sample_is_the_centre() -> None:
    assert list(samples(1)) == [CENTRE]


@given(st.integers(0, 2**32 - 1), st.integers(0, 6))
def test_every_pattern_is_a_net(pattern: int, log_count: int) -> None:
    """Among the first 2^m points each elementary interval of area 2^-m holds exactly one."""
    points = np.array([owen_sobol(i, pattern) for i in range(2**log_count)])
    for k in range(log_count + 1):
        cells = np.floor(points * [2**k, 2 ** (log_count - k)]).astype(int)
        assert len(np.unique(cells, axis=0)) == len(points)


@given(st.integers(0, 2**32 - 1), st.integers(0, 7))
def test_the_third_coordinate_is_stratified_too(pattern: int, log_count: int) -> None:
    third = [owen_sobol_3d(i, pattern)[2] for i in range(2**log_count)]
    assert sorted(np.floor(np.array(third) * 2**log_count)) == list(range(2**log_count))


def test_patterns_are_independent() -> None:
    """No correlation between two patterns beyond chance: 1/√1024 = 3 %, three times that allowed."""
    columns = np.array([[*owen_sobol(i, 0), *owen_sobol(i, 1), *owen_sobol(i, 7)] for i in range(1024)])
    off_diagonal = np.corrcoef(columns.T) - np.eye(6)
    assert np.abs(off_diagonal).max() < 0.1


def test_an_integral_converges_faster_than_chance() -> None:
    """x² y over the square is 1/6; 1024 points come within 1e-4, where random ones leave 6e-3."""
    points = np.array([owen_sobol(i, 3) for i in range(1024)])
    assert (points[:, 0] ** 2 * points[:, 1]).mean() == pytest.approx(1 / 6, abs=1e-4)


@pytest.mark.parametrize("count", [2, 3, 8, 13, 16, 48, 64])
def test_a_grid_is_even_in_rows_columns_and_the_square(count: int) -> None:
    """By SciPy's mixture discrepancy of Sobol's points too, that of half the patterns at least."""
    grid = np.array([even_grid(k, count)[:2] for k in range(count)])
    for places in grid.T:
        np.testing.assert_allclose(np.sort(places), (np.arange(count) + 0.5) / count)
    found = discrepancy(grid, method="MD")
    sobol = [discrepancy([owen_sobol(i, pattern) for i in range(count)], method="MD") for pattern in range(9)]
    assert found < np.median(sobol)


def test_few_samples_bring_a_lattice_to_a_light() -> None:
    """In an order of each light's own; Sobol's points where the render may stop, or the lattice would be large."""
    drawn = list(samples(8))
    places = [sample.on_round(3, k, 2) for sample in drawn for k in range(2)]
    assert sorted(places) == sorted(spiral(k, 16) for k in range(16))
    assert places != [sample.on_round(4, k, 2) for sample in drawn for k in range(2)]
    assert [s.on_round(3) for s in samples(8, may_stop=True)] == [s.on_light(3) for s in drawn]
    assert sorted(s.on_rectangle(3) for s in drawn) == sorted(even_grid(k, 8) for k in range(8))
    assert drawn[1].on_round(3, 0, 16) == drawn[1].on_light(3, 0, 16)
