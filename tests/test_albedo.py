"""The bound on a lobe's directional albedo: it holds, it lies close, and both languages have the same."""

from __future__ import annotations

import math
import re
from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defshade_cli import resources
from defshade_cli.measure.albedo import (
    TOLERANCE,
    VISIBILITY,
    AlbedoTable,
    albedo_table,
    excess,
    fit_edge,
    lobe_albedo,
)
from defshade_cli.measure.brdf import SMITH_GGX, SMITH_SCHLICK, EdgeFit, edge_bound
from defshade_cli.settings import SHADINGS, Shading

FITS: dict[Shading, EdgeFit] = {"preview-surface": SMITH_GGX, "classic": SMITH_SCHLICK}
NAMES: dict[Shading, str] = {"preview-surface": "SMITH_GGX", "classic": "SMITH_SCHLICK"}
CLOSE = {"preview-surface": 0.02, "classic": 0.04}
"""How far above B the bound may lie where the cosine is at least 0.1."""

cosines = st.floats(0.0, 1.0)
alphas = st.floats(1e-4, 1.0)


@pytest.fixture(scope="module", params=SHADINGS)
def shading(request: pytest.FixtureRequest) -> Shading:
    return request.param


@pytest.fixture(scope="module")
def table(shading: Shading) -> AlbedoTable:
    return albedo_table(VISIBILITY[shading])


def test_edge_bound_holds_and_lies_close(shading: Shading, table: AlbedoTable) -> None:
    over = excess(table, FITS[shading])
    assert over.min() >= -1.1 * TOLERANCE  # rounding to four digits costs the tenth
    assert over[:, table.cosines >= 0.1].max() <= CLOSE[shading]
    assert over.mean() <= 0.01


def test_white_bound_holds(table: AlbedoTable) -> None:
    white = 1.0 - math.log(2.0) * table.alphas[:, None] ** 2 * table.cosines
    assert (table.white <= white + TOLERANCE).all()


def test_constants_are_what_the_fit_gives(shading: Shading, table: AlbedoTable) -> None:
    """But for their rounding to four digits."""
    assert astuple(FITS[shading]) == pytest.approx(astuple(fit_edge(table)), rel=1e-3, abs=5e-4)


def test_shader_has_the_same_constants(shading: Shading) -> None:
    source = (resources.SHADERS / "lib" / "brdf.glsl").read_text(encoding="utf-8")
    found = re.search(rf"const vec4 {NAMES[shading]} = vec4\((.*?)\);", source)
    assert found
    assert EdgeFit(*map(float, found[1].split(","))) == FITS[shading]


@given(cosines, cosines, alphas, st.sampled_from([SMITH_GGX, SMITH_SCHLICK]))
def test_edge_bound_falls_with_the_cosine(one: float, other: float, alpha: float, fit: EdgeFit) -> None:
    """So that at min(NoV, NoL) it bounds what the lobe takes of either direction."""
    low, high = sorted((one, other))
    bounds = edge_bound(np.array([low, high]), np.array(alpha), fit)
    assert bounds[0] >= bounds[1] - 1e-12
    assert bounds[0] <= 1.0
    assert bounds[1] >= 0.0


def test_albedo_of_a_mirror_is_schlicks_term() -> None:
    for cosine in (0.9, 0.5, 0.2):
        white, edge = lobe_albedo(VISIBILITY["preview-surface"], cosine, 1e-4)
        assert white == pytest.approx(1.0, abs=1e-4)
        assert edge == pytest.approx((1.0 - cosine) ** 5, abs=1e-4)


def test_albedo_of_the_roughest_white_lobe_at_normal_incidence() -> None:
    """1 − ln 2: at alpha 1 D is uniform, and V = 1 / (2 (1 + NoL))."""
    assert lobe_albedo(VISIBILITY["preview-surface"], 1.0, 1.0)[0] == pytest.approx(1.0 - math.log(2.0), abs=1e-4)
