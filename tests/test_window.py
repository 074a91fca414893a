"""The data window: crops and overscan."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from defshade_cli import render
from defshade_cli.errors import UsageError
from defshade_cli.image.layers import LAYERS
from defshade_cli.scene.window import DataWindow, from_ndc

SIZE = (64, 48)


@given(st.tuples(*[st.floats(-1.0, 2.0)] * 4), st.tuples(st.integers(1, 400), st.integers(1, 400)))
def test_a_window_holds_the_pixels_whose_centres_it_contains(
    corners: tuple[float, float, float, float], display: tuple[int, int]
) -> None:
    xmin, xmax = sorted(corners[:2])
    ymin, ymax = sorted(corners[2:])
    x = [c for c in range(-500, 1000) if xmin <= Fraction(2 * c + 1, 2 * display[0]) < xmax]
    y = [c for c in range(-500, 1000) if ymin < 1 - Fraction(2 * c + 1, 2 * display[1]) <= ymax]
    if not x or not y:
        with pytest.raises(UsageError, match="no pixels"):
            from_ndc((xmin, ymin, xmax, ymax), display)
    else:
        assert from_ndc((xmin, ymin, xmax, ymax), display) == DataWindow(x[0], y[0], len(x), len(y))


def test_a_window_that_is_not_finite_is_refused() -> None:
    with pytest.raises(UsageError, match="no pixels"):
        from_ndc((0.0, 0.0, float("nan"), 1.0), (64, 48))


def test_the_whole_image_is_the_default() -> None:
    assert from_ndc((0.0, 0.0, 1.0, 1.0), (1920, 1081)) == DataWindow(0, 0, 1920, 1081)


@pytest.mark.parametrize("crop", [(10, 5, 20, 30), (-8, -4, 80, 56)])
def test_a_crop_is_a_part_of_the_image(crop: tuple[int, int, int, int], scenes: Path) -> None:
    """Rasterizers snap vertices to 1/256 pixel: normals move by less than 1e-3, and sharp highlights by more."""
    names = tuple(name for name in LAYERS if name in ("beauty", "depth", "normal", "position"))
    whole = render(scenes / "showcase.usda", size=SIZE, layers=names)
    part = render(scenes / "showcase.usda", size=SIZE, layers=names, crop=crop)
    x, y, width, height = crop
    assert (part.size, part.origin, part.display_size) == ((width, height), (x, y), SIZE)
    rows, columns = slice(max(y, 0), min(y + height, SIZE[1])), slice(max(x, 0), min(x + width, SIZE[0]))
    inner = slice(rows.start - y, rows.stop - y), slice(columns.start - x, columns.stop - x)
    for name in names:
        expected, found = whole.layers[name][rows, columns], part.layers[name][inner]
        close = np.isclose(found, expected, rtol=1e-3, atol=1e-3).all(axis=-1)
        assert close.mean() > (0.95 if name == "beauty" else 0.999)
