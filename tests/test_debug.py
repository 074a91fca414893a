"""What --debug draws over the image."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from defshade_cli.passes.debug_volumes import laid_over
from defshade_cli.rendering import render

SMALL = (64, 48)


@pytest.mark.parametrize("name", ["light_sphere", "light_cone", "light_distant"])
@pytest.mark.parametrize("layout", ["float", "rgba8"])
def test_a_volume_is_drawn_in_colour_over_the_beauty(scenes: Path, name: str, layout: str) -> None:
    plain = render(scenes / f"{name}.usda", size=SMALL, layout=layout)
    shown = render(scenes / f"{name}.usda", size=SMALL, layout=layout, debug="volumes")
    changed = np.abs(shown.layers["beauty"] - plain.layers["beauty"])[..., :3].max(axis=-1) > 1e-3
    assert 0.02 < changed.mean() <= 1.0


def test_a_distant_light_frames_the_image(scenes: Path) -> None:
    beauty, shown = (
        render(scenes / "light_distant.usda", size=SMALL, debug=debug).layers["beauty"] for debug in (None, "volumes")
    )
    assert (np.abs(shown - beauty)[0].max(axis=-1) > 0.1).all()
    np.testing.assert_array_equal(shown[24, 32, :3], beauty[24, 32, :3])


def test_data_layers_are_left_alone(scenes: Path) -> None:
    depth = [
        render(scenes / "light_sphere.usda", size=SMALL, layers=("beauty", "depth"), debug=debug).layers["depth"]
        for debug in (None, "volumes")
    ]
    np.testing.assert_array_equal(*depth)


def test_what_is_laid_over_covers_by_its_alpha() -> None:
    image, overlay = np.full((1, 1, 4), 0.5, np.float32), np.array([[[0.25, 0.0, 0.0, 0.5]]], np.float32)
    assert laid_over(image, overlay)[0, 0] == pytest.approx([0.5, 0.25, 0.25, 1.0])
