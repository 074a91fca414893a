"""The studio of stages without lights."""

from __future__ import annotations

import logging
import math
from pathlib import Path

import numpy as np
import pytest

from defshade_cli.rendering import run
from defshade_cli.scene.framing import Framing
from defshade_cli.scene.light import RectLight
from defshade_cli.settings import RenderJob, RenderSettings
from stages import read

CUBE = 'def Cube "c" {\n}\n'


def test_three_softboxes_and_a_dome_light_what_has_no_light(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "defshade"):
        scene = read(CUBE, studio=True)
    assert [light.kind for light in scene.lights] == ["dome", "rect", "rect", "rect"]
    assert scene.lit_by == "studio"
    assert "the studio lights it" in caplog.text


def test_a_light_of_the_stage_is_the_only_one(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "defshade"):
        scene = read(CUBE + 'def SphereLight "l" {\n}', studio=True)
    assert [light.path for light in scene.lights] == ["/l"]
    assert scene.lit_by == "stage"
    assert "no studio is added" in caplog.text


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_softboxes_face_the_asset_and_turn_with_the_camera(up: str) -> None:
    """The key stands on the camera's left, above it; the rim behind the asset."""
    scene = read(CUBE, framing=Framing((75.0, 0.0)), studio=True, metadata=f'upAxis = "{up}"')
    key, _, rim = (light for light in scene.lights if isinstance(light, RectLight))
    right, above, back = scene.camera.world_from_camera[:3, :3].T
    for light in (key, rim):
        assert np.dot(light.axis, -light.position / np.linalg.norm(light.position)) == pytest.approx(1.0)
        assert np.dot(light.position, above) > 0
    assert np.dot(key.position, right) < 0 < np.dot(key.position, back)
    assert np.dot(rim.position, back) < 0


def test_light_does_not_depend_on_the_size_of_the_asset() -> None:
    def irradiance(scale: float) -> float:
        asset = f'def Cube "c" {{\ndouble size = {scale}\n}}'
        key = next(light for light in read(asset, studio=True).lights if isinstance(light, RectLight))
        return float(key.intensity_on_axis[0]) / float(np.dot(key.position, key.position))

    assert irradiance(1000.0) == pytest.approx(irradiance(0.01), rel=1e-6)
    assert irradiance(1.0) < math.pi * 1.5


def test_the_picture_says_whose_light_it_is(tmp_path: Path) -> None:
    stage = tmp_path / "asset.usda"
    stage.write_text(f"#usda 1.0\n{CUBE}")
    for studio, expected in ((True, "studio"), (False, "camera light")):
        result = next(iter(run(RenderJob(stage, settings=RenderSettings(size=(16, 16), studio=studio)))))
        film = result.images[0].film
        assert film is not None and film.metadata["lights"] == expected
        assert film.layers["beauty"][8, 8, :3].min() > 0.05
