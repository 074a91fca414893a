"""The figures of the documents: which there are, and what stands below their tiles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from build import camera
from defshade_cli.image.film import Film
from defshade_cli.image.layers import BEAUTY
from defshade_cli.measure import gallery
from defshade_cli.resources import SCENES
from defshade_cli.settings import RenderSettings

IMAGES = Path(__file__).resolve().parent.parent / "docs" / "images"
OTHERS = {"view.png", "accuracy.svg", "lights.svg"}
"""Drawn by a browser, by make accuracy, and by benchmarks/lights.py."""


def test_every_figure_is_drawn_by_make_gallery() -> None:
    drawn = {*gallery.FIGURES, "convergence.png", "pareto.svg"}
    assert {path.name for path in IMAGES.iterdir()} - OTHERS == drawn
    assert all((SCENES / scene).exists() for scene, _ in gallery.FIGURES.values())


def test_the_strip_says_how_far_each_picture_is_from_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of grey pictures that are off by a tenth over the root of their samples."""

    def draw(_scene: str, settings: RenderSettings, _renderer: object) -> Film:
        off = 0.0 if settings.samples == 1024 else 0.1 / np.sqrt(settings.samples)
        beauty = np.full((8, 8, 4), (0.5 + off, 0.5 + off, 0.5 + off, 1.0), np.float32)
        return Film({BEAUTY: beauty}, camera(), "grey", samples=settings.samples)

    monkeypatch.setattr(gallery, "_film", draw)
    film = gallery._convergence(None)  # type: ignore[arg-type]
    shown = sorted(film.layers)
    assert shown == ["1 sample", "16 samples", "256 samples", "off by, at 1", "off by, at 16", "off by, at 256"]
    errors = [float(film.row(name).summary.split()[1].rstrip(",")) for name in shown[:3]]
    np.testing.assert_allclose(np.array(errors[:-1]) / errors[1:], 16.0, rtol=0.1)
    np.testing.assert_allclose(film.layers["off by, at 1"][0, 0], (0.4, 0.4, 0.4, 1.0), rtol=1e-5)
