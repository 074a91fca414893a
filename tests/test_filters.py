"""Pixel filters: what they draw, and what an edge looks like through them."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad as integral
from scipy.special import erf

from build import at, beauty, camera, drawable, quad, scene
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.filters import blackman_harris_cdf, filter_offset
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.material import Material
from defshade_cli.settings import FILTERS, Filter, RenderSettings

GLOWING = Material("/glow", diffuse_color=(0, 0, 0), emissive_color=(1, 1, 1))
U = (np.arange(4096) + 0.5) / 4096


def gaussian(t: float) -> float:
    return math.exp(-8.0 * t * t)


def blackman_harris(t: float) -> float:
    waves = enumerate((0.35875, 0.48829, 0.14128, 0.01168))
    return sum(a * math.cos(math.tau * k * t) for k, a in waves)


DENSITIES = {"box": lambda _: 1.0, "gaussian": gaussian, "blackman-harris": blackman_harris}


def drawn(kind: Filter, width: float = 1.0) -> NDArray[np.float64]:
    return np.array([filter_offset(kind, width, (u, 0.5))[0] for u in U])


@pytest.mark.parametrize("kind", FILTERS)
def test_moments_are_the_density_s(kind: Filter) -> None:
    """Midpoints in u against quadrature of the filter's own formula. In the last of 4096 steps Blackman-Harris, whose
    ends are all but 0, moves by a fifteenth of its width: 2e-6 of the second moment."""
    density, offsets = DENSITIES[kind], drawn(kind)
    total = integral(density, -0.5, 0.5)[0]
    for power in (1, 2, 3, 4):
        expected = integral(lambda t, p=power: t**p * density(t), -0.5, 0.5)[0] / total
        assert (offsets**power).mean() == pytest.approx(expected, abs=5e-6)


@pytest.mark.parametrize("kind", FILTERS)
@given(u=st.floats(0.0, 1.0), width=st.floats(0.1, 8.0))
def test_offsets_are_symmetric_monotonic_and_within_the_width(kind: Filter, u: float, width: float) -> None:
    x, y = filter_offset(kind, width, (u, 1.0 - u))
    assert abs(x) <= 0.5 * width * (1 + 1e-12)
    assert x == pytest.approx(-y, abs=1e-6 * width)
    assert filter_offset(kind, width, (min(1.0, u + 1e-3), 0.0))[0] >= x


def test_the_inverse_is_exact() -> None:
    """The distribution at what the inverse gives is u again, to the rounding of float64."""
    for u in U[::64]:
        assert blackman_harris_cdf(filter_offset("blackman-harris", 1.0, (u, 0.5))[0]) == pytest.approx(u, abs=1e-15)


def edge_response(kind: Filter, width: float, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The filter's integral up to x pixels: what a pixel at x from a straight edge reads."""
    t = np.clip(x / width, -0.5, 0.5)
    match kind:
        case "box":
            return 0.5 + t
        case "gaussian":
            return 0.5 + 0.5 * erf(math.sqrt(8.0) * t) / erf(math.sqrt(2.0))
        case _:
            return np.array([blackman_harris_cdf(v) for v in t])


@pytest.mark.parametrize(("kind", "width"), [*FILTERS.items(), ("box", 4.0), ("gaussian", 5.0)])
def test_an_edge_has_the_closed_form(gpu: Gpu, kind: Filter, width: float) -> None:
    """A half plane that ends at the middle of the image. Rasterisers place edges to 1/256 of a pixel, 1024 stratified
    samples are within 1/1024, and no density passes 1.0 a pixel: 0.005.
    """
    of = scene([quad(50.0)], [], [GLOWING], camera(5.0, 0.5), [drawable(quad(50.0), where=[at(50.0, 0, 0)])])
    plan = make_plan(of, RenderSettings(size=(16, 4), samples=1024, filter=kind, filter_width=width))
    row = beauty(Pipeline(gpu).render(of, plan).layers)[2, :, 0]
    np.testing.assert_allclose(row, edge_response(kind, width, np.arange(16) - 7.5), atol=5e-3)


def test_a_single_sample_and_the_data_layers_know_no_filter(gpu: Gpu) -> None:
    of = scene([quad(0.7)], [], [GLOWING])
    pipeline = Pipeline(gpu)

    def layer(name: str, **options: object) -> NDArray[np.float32]:
        plan = make_plan(of, RenderSettings(size=(16, 16), layers=("beauty", "depth"), **options))  # type: ignore[arg-type]
        return pipeline.render(of, plan).layers[name]

    np.testing.assert_array_equal(layer("beauty"), layer("beauty", filter="gaussian"))
    np.testing.assert_array_equal(layer("depth", samples=8), layer("depth", samples=8, filter="blackman-harris"))
    widths = [layer("beauty", samples=64, filter_width=w)[8, :, 0] for w in (1.0, 3.0, 6.0)]
    grey = [((row > 0.01) & (row < 0.99)).sum() for row in widths]
    assert all(a < b for a, b in pairwise(grey))
