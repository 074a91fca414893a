"""Cameras of ours: --fit, --turntable and --direction."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from defshade_cli.cli import command_of, defshade
from defshade_cli.cli.arguments import option_arguments
from defshade_cli.farm.open_job import OpenJob
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.framing import Framing
from defshade_cli.settings import RenderJob, RenderSettings
from defshade_cli.spaces import transform_points
from stages import read

WINDOW = (-0.2, 0.2, -0.15, 0.15)
SIDES = st.floats(0.1, 10.0)
DEGREES = st.floats(-180.0, 180.0)
ELEVATIONS = st.floats(-90.0, 90.0)


def box(*sides: float) -> np.ndarray:
    return np.array([[5.0, -3.0, 2.0], np.add([5.0, -3.0, 2.0], sides)])


def on_window(camera: Camera, bounds: np.ndarray) -> np.ndarray:
    """(8, 2) corners of the box as shares of the window's halves; inside are those up to 1."""
    corners = np.array(np.meshgrid(*bounds.T)).reshape(3, 8).T
    seen = transform_points(camera.camera_from_world, corners)
    assert (-seen[:, 2] > camera.clipping_range[0]).all() and (-seen[:, 2] < camera.clipping_range[1]).all()
    return np.abs(seen[:, :2] / -seen[:, 2:]) / [camera.window[1], camera.window[3]]


@given(st.tuples(SIDES, SIDES, SIDES), DEGREES, ELEVATIONS, st.sampled_from("YZ"))
def test_a_fitted_box_fills_the_image_and_stays_inside(
    sides: tuple[float, float, float], azimuth: float, elevation: float, up: str
) -> None:
    """All but the margin of 6 %; a flat box seen edge on keeps a little distance."""
    shares = on_window(Framing((azimuth, elevation)).camera(box(*sides), up, WINDOW, None), box(*sides))
    assert shares.max() == pytest.approx(1 / 1.06, rel=1e-6)


@given(st.tuples(SIDES, SIDES, SIDES), ELEVATIONS, st.integers(1, 48), st.sampled_from("YZ"))
def test_a_turn_has_all_in_view_at_one_distance(
    sides: tuple[float, float, float], elevation: float, frame: int, up: str
) -> None:
    framing, bounds = Framing((30.0, elevation), turn=48), box(*sides)
    first, then = (framing.camera(bounds, up, WINDOW, at) for at in (1.0, float(frame)))
    assert on_window(then, bounds).max() <= 1.0
    away = [float(np.linalg.norm(camera.position - bounds.mean(axis=0))) for camera in (first, then)]
    assert away[0] == pytest.approx(away[1], rel=1e-9)


@pytest.mark.parametrize(("up", "front"), [("Y", (0, 0, 1)), ("Z", (0, -1, 0))])
@pytest.mark.parametrize(("azimuth", "towards"), [(0, "front"), (90, (1, 0, 0))])
def test_directions_are_those_of_the_stage(up: str, front: tuple, azimuth: float, towards: str | tuple) -> None:
    camera = Framing((azimuth, 0.0)).camera(box(1, 1, 1), up, WINDOW, None)
    expected = front if towards == "front" else towards
    assert camera.world_from_camera[:3, 2] == pytest.approx(np.array(expected), abs=1e-12)


def test_a_quarter_of_the_frames_is_a_quarter_turn() -> None:
    framing = Framing((0.0, 0.0), turn=8)
    assert framing.camera(box(1, 1, 1), "Y", WINDOW, 3.0).world_from_camera[:3, 2] == pytest.approx(
        (1, 0, 0), abs=1e-12
    )


def test_what_is_framed_is_the_stage_whatever_cameras_it_has() -> None:
    scene = read('def Cube "c" {\n}\ndef Camera "cam" {\n}', framing=Framing(), size=(100, 300))
    assert scene.camera.path == "<fit>"
    assert scene.camera.aspect == pytest.approx(1 / 3)


def test_a_turn_does_not_sway_with_what_moves() -> None:
    moving = """def Cube "c" {
        double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 9: (50, 0, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }"""
    span = "startTimeCode = 1\nendTimeCode = 9"
    cameras = [read(moving, frame, span, framing=Framing(turn=8)).camera for frame in (1.0, 9.0)]
    np.testing.assert_allclose(cameras[0].world_from_camera, cameras[1].world_from_camera, atol=1e-9)


def test_a_job_of_a_turn_has_its_frames() -> None:
    job = RenderJob(Path("a.usda"), settings=RenderSettings(turntable=3))
    assert job.frames == (1.0, 2.0, 3.0)
    assert RenderJob(Path("a.usda"), (2.0,), settings=RenderSettings(turntable=3)).frames == (2.0,)


def test_the_options_of_a_turn_survive_the_way_to_a_farm(scenes: Path) -> None:
    job = RenderJob(scenes / "gprims.usda", settings=RenderSettings(turntable=3, direction=(10.0, -5.0), studio=True))
    typed = option_arguments(job, command_of("render").params)
    with command_of("render").make_context("render", ["a.usda", *typed]) as context:
        assert context.params["turntable"] == 3
        assert context.params["direction"] == (10.0, -5.0)
        assert context.params["studio"]
    assert OpenJob(job).shots(1.0)[0].camera == "turntable"


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--fit", "--camera", "cam"], "--camera and --fit exclude each other"),
        (["--turntable", "4", "--camera", "cam"], "--camera and --turntable exclude each other"),
        (["--turntable", "4", "--default-time"], "--turntable and --default-time exclude each other"),
        (["--direction", "left"], "--direction is for --fit and --turntable"),
        (["--fit", "--direction", "above"], "'above' is none of front"),
        (["--fit", "--direction", "0,91"], "'0,91' is none of front"),
    ],
)
def test_what_does_not_go_together_is_said(scenes: Path, options: list[str], complaint: str) -> None:
    result = CliRunner().invoke(defshade, ["inspect", str(scenes / "gprims.usda"), *options])
    message = result.output + (str(result.exception) if not isinstance(result.exception, click.ClickException) else "")
    assert result.exit_code != 0 and complaint in message
