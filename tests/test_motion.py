"""Motion of what is seen, from frame to frame, in pixels."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from build import at, camera, drawable, quad, scene, sphere, sun
from defshade_cli import render
from defshade_cli.image.film import Film
from defshade_cli.image.metadata import world_to_ndc
from defshade_cli.plan import make_plan
from defshade_cli.scene.motion import moment_of
from defshade_cli.settings import RenderSettings

SIZE = (96, 64)
FORTH, BACK = "motionForward", "motionBackward"

HEAD = """#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 10
)
"""
CAMERA = """
def Camera "cam" {
    float2 clippingRange = (0.1, 100)
    float horizontalAperture = 24
    float verticalAperture = 16
    float focalLength = 24
    double3 xformOp:translate.timeSamples = { 1: (0, 0, 6), 5: (0.4, -0.2, 5.6) }
    float xformOp:rotateY.timeSamples = { 1: -4, 5: 6 }
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]
}
"""


def card(name: str, op: str, points: str = "", color: str = "(0.9, 0.1, 0.1)") -> str:
    """A square with smooth colours, its points and its one operation as given."""
    still = "point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]"
    return f"""
def Mesh "{name}" {{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    {points or still}
    color3f[] primvars:displayColor = [{color}, (0.1, 0.8, 0.1), (0.2, 0.2, 0.9), (0.9, 0.9, 0.2)] (
        interpolation = "vertex"
    )
    {op}
}}
"""


def moving(kind: str, values: str) -> str:
    return f'{kind}.timeSamples = {{ {values} }}\n    uniform token[] xformOpOrder = ["{kind.split()[1]}"]'


SLIDING = card("sliding", moving("double3 xformOp:translate", "1: (-1, 0, 0), 5: (1, 0.8, 0.4)"))
BENDING = card(
    "bending",
    'double3 xformOp:translate = (0, 0, -1)\n    uniform token[] xformOpOrder = ["xformOp:translate"]',
    """point3f[] points.timeSamples = {
        1: [(-3, -2, 0), (3, -2, 0), (3, 2, 0), (-3, 2, 0)],
        5: [(-2, -2, 0), (3, -2.5, 0.5), (3.5, 2, -1), (-3, 2.5, 0.5)],
    }""",
)


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("motion") / "shot.usda"
    path.write_text(HEAD + CAMERA + SLIDING + BENDING)
    return path


def frame(stage: Path, number: float | None, *layers: str) -> Film:
    return render(stage, frame=number, size=SIZE, layers=layers)


def pixel_centres() -> NDArray[np.float64]:
    """(H, W, 2) x and y."""
    return np.stack(np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5), axis=-1)


def warped(now: Film, then: Film, motion: str) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """`then`'s albedo where the motion leads to, and the pixels whose prim all four pixels there show too."""
    x, y = np.moveaxis(pixel_centres() + now.layers[motion] * (1, -1), -1, 0) - 0.5
    channels = [map_coordinates(then.layers["albedo"][..., c].astype(np.float64), [y, x], order=1) for c in range(3)]
    around = [(np.floor(y) + dy, np.floor(x) + dx) for dy in (0, 1) for dx in (0, 1)]
    ids = [then.layers["primId"][_clipped(row, SIZE[1]), _clipped(column, SIZE[0])] for row, column in around]
    same = np.all([each == now.layers["primId"] for each in ids], axis=0) & (now.layers["primId"] >= 0)
    return np.stack(channels, axis=-1), same[..., 0] & (x > 0) & (y > 0) & (x < SIZE[0] - 1) & (y < SIZE[1] - 1)


def _clipped(index: NDArray[np.float64], count: int) -> NDArray[np.intp]:
    return index.astype(np.intp).clip(0, count - 1)


@pytest.mark.parametrize(("motion", "to"), [(FORTH, 4.0), (BACK, 2.0)])
def test_motion_warps_a_frame_onto_its_neighbour(shot: Path, motion: str, to: float) -> None:
    """Camera, placements and points all move, by pixels."""
    now, then = frame(shot, 3.0, "albedo", "primId", motion), frame(shot, to, "albedo", "primId")
    image, seen = warped(now, then, motion)
    still = np.square(then.layers["albedo"] - now.layers["albedo"])[seen].mean()
    left = np.square(image - now.layers["albedo"])[seen].mean()
    assert seen.mean() > 0.5 and np.abs(now.layers[motion]).max() > 3.0
    assert -10 * np.log10(left) > 60.0  # dB; bilinear reading of a bilinear colour leaves little
    assert -10 * np.log10(still) < 20.0


def test_motion_leads_to_where_the_point_is_reprojected(tmp_path: Path) -> None:
    """A rigid slide of (0.5, 0.2, 0.1) a frame under a moving camera: within a hundredth of a pixel."""
    stage = tmp_path / "slide.usda"
    stage.write_text(HEAD + CAMERA + SLIDING)
    now, then = frame(stage, 3.0, FORTH, "position", "depth"), frame(stage, 4.0, "depth")
    covered = np.isfinite(now.layers["depth"][..., 0])
    points = now.layers["position"][covered] + (0.5, 0.2, 0.1)
    ndc = np.column_stack([points, np.ones(len(points))]) @ world_to_ndc(then.camera)
    expected = ndc[:, :2] / ndc[:, 3:] * SIZE
    found = (pixel_centres() + now.layers[FORTH] * (1, -1))[covered]
    np.testing.assert_allclose(found, expected, atol=0.01)


def test_what_stands_still_does_not_move(tmp_path: Path) -> None:
    stage = tmp_path / "still.usda"
    stage.write_text(HEAD + card("still", "") + 'def Sphere "ball" {\n}\n')
    film = frame(stage, 3.0, FORTH, BACK)
    assert not film.layers[FORTH].any() and not film.layers[BACK].any()


def test_the_default_time_has_no_motion(shot: Path) -> None:
    assert not frame(shot, None, "motionForward").layers[FORTH][:2].any()
    film = render(shot, size=SIZE, layers=(FORTH,), frame=None)
    assert film.layers[FORTH].shape == (64, 96, 2)


def test_before_the_first_key_nothing_has_moved(shot: Path) -> None:
    film = frame(shot, 1.0, BACK, FORTH)
    assert not film.layers[BACK].any() and film.layers[FORTH].any()


def test_instances_are_known_by_path_and_id() -> None:
    """Two copies, named by id, that came in another order; a third that is not there yet stays."""
    mesh = quad()
    now = replace(drawable(mesh, where=[at(0, 0, 0), at(5, 0, 0), at(9, 9, 9)]), instance_ids=[7, 3, 8])
    then = replace(drawable(mesh, where=[at(6, 0, 0), at(1, 0, 0)]), instance_ids=[3, 7])
    moment = moment_of([now], [mesh], camera(), [then], [mesh])
    assert moment.placements[0][:, 0, 3].tolist() == [1, 6, 9]
    assert moment.points[0] is mesh.points


def test_another_topology_has_no_motion_of_its_own() -> None:
    fine, coarse = replace(sphere(1.0, 8), path="/ball"), replace(sphere(2.0, 4), path="/ball")
    grown = replace(fine, points=2 * fine.points)
    where = [drawable(fine)]
    assert moment_of(where, [fine], camera(), where, [coarse]).points[0] is fine.points
    np.testing.assert_array_equal(moment_of(where, [fine], camera(), where, [grown]).points[0], 2 * fine.points)


def test_a_crop_moves_by_the_same_pixels(shot: Path) -> None:
    whole = frame(shot, 3.0, FORTH).layers[FORTH]
    part = render(shot, frame=3.0, size=SIZE, crop=(20, 10, 40, 30), layers=(FORTH,)).layers[FORTH]
    np.testing.assert_allclose(part, whole[10:40, 20:60], atol=1e-3)


def test_motion_is_read_and_drawn_where_it_is_asked() -> None:
    of = scene([quad()], [sun()])
    assert "MOTION" in make_plan(of, RenderSettings(layers=(BACK,))).inputs
    assert "MOTION" not in make_plan(of, RenderSettings(layers=("beauty", "depth"))).inputs
