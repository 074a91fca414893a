"""Motion blur: what the shutter sees, against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from defshade_cli import render
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan, plan_moments
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader
from stages import stage_of

WIDTH, HEIGHT = 64, 8
PIXEL = 0.125
"""A pixel is this many units at the plane z = 0."""

CAMERA = f"""def Camera "camera" {{
    token projection = "orthographic"
    float horizontalAperture = {10 * WIDTH * PIXEL}
    float verticalAperture = {10 * HEIGHT * PIXEL}
    float2 clippingRange = (1, 20)
    double shutter:open = OPEN
    double shutter:close = CLOSE
    WHERE
}}
"""
FIXED = 'double3 xformOp:translate = (0, 0, 10)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
PANNING = FIXED.replace(" = (0, 0, 10)", ".timeSamples = { 0: (-2, 0, 10), 2: (2, 0, 10) }")

QUAD = """def Mesh "quad" {
    point3f[] points = [(0, -1, 0), (1, -1, 0), (1, 1, 0), (0, 1, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
    WHERE
}
def DistantLight "sun" {
    float inputs:intensity = 10
}
"""
STILL = 'double3 xformOp:translate = (0, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
MOVING = STILL.replace(" = (0, 0, 0)", ".timeSamples = { 0: (-2, 0, 0), 2: (2, 0, 0) }")
DEFORMING = """point3f[] points.timeSamples = {
    0: [(-2, -1, 0), (-1, -1, 0), (-1, 1, 0), (-2, 1, 0)],
    2: [(2, -1, 0), (3, -1, 0), (3, 1, 0), (2, 1, 0)]
}"""
CARRIED = """point3f[] points.timeSamples = { 1: [(0, -1, 0), (1, -1, 0), (1, 1, 0), (0, 1, 0)] }
    vector3f[] velocities.timeSamples = { 1: [(48, 0, 0), (48, 0, 0), (48, 0, 0), (48, 0, 0)] }"""


def _stage(quad: str, camera: str = FIXED, shutter: tuple[float, float] = (0.0, 1.0)) -> StageReader:
    opened = CAMERA.replace("OPEN", str(shutter[0])).replace("CLOSE", str(shutter[1])).replace("WHERE", camera)
    text = QUAD.replace("WHERE", quad)
    if "faceVertexCounts" in quad:
        text = text.replace("int[] faceVertexCounts = [4]\n", "").replace(
            "int[] faceVertexIndices = [0, 1, 2, 3]\n", ""
        )
    if "points" in quad:
        text = text.replace("point3f[] points = [(0, -1, 0), (1, -1, 0), (1, 1, 0), (0, 1, 0)]\n", "")
    return StageReader(
        stage_of(opened + text, "timeCodesPerSecond = 24\nmetersPerUnit = 1"), ReadOptions(size=(WIDTH, HEIGHT))
    )


def _beauty(pipeline: Pipeline, reader: StageReader, samples: int, **options: object) -> NDArray[np.float32]:
    scene = reader.read(1.0)
    settings = RenderSettings(size=(WIDTH, HEIGHT), samples=samples, **options)  # type: ignore[arg-type]
    plan = make_plan(scene, settings)
    moments = plan_moments(plan, reader.read_shutter(scene, plan.moments), settings)
    return pipeline.render(scene, plan, moments).layers["beauty"]


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


# A quad of 8 pixels moves by 16 pixels to the right while the shutter is open, from the image's middle on.


def _trapezium(pixels: NDArray[np.float64], start: float = 32.0, width: float = 8.0, way: float = 16.0) -> NDArray:
    """Share of the time for which each pixel's centre is covered by what moves evenly."""
    first, last = (pixels - start - width) / way, (pixels - start) / way
    return np.clip(last, 0, 1) - np.clip(first, 0, 1)


@pytest.mark.parametrize(
    ("quad", "camera"),
    [(MOVING, FIXED), (DEFORMING, FIXED), (CARRIED, FIXED), (STILL.replace("0, 0, 0", "2, 0, 0"), PANNING)],
    ids=["transform", "deformation", "velocities", "camera"],
)
def test_even_motion_is_a_ramp_of_alpha(pipeline: Pipeline, quad: str, camera: str) -> None:
    alpha = _beauty(pipeline, _stage(quad, camera), 32)[HEIGHT // 2, :, 3]
    centres = np.arange(WIDTH) + 0.5
    expected = _trapezium(centres)
    # 32 moments are half a pixel apart: of two edges in a pixel, each is on the wrong side in one of them at most.
    assert np.abs(alpha - expected).max() <= 2 / 32 + 1e-6
    assert alpha.sum() == pytest.approx(8.0, abs=0.25)


def test_the_mean_is_linear_light(pipeline: Pipeline) -> None:
    blurred = _beauty(pipeline, _stage(MOVING), 32)[HEIGHT // 2]
    sharp = _beauty(pipeline, _stage(STILL), 32)[HEIGHT // 2]
    covered = blurred[:, 3] > 0
    colour = sharp[sharp[:, 3] == 1][0]
    np.testing.assert_allclose(blurred[covered], blurred[covered, 3:] * colour, rtol=1e-4)


def test_what_is_still_is_bit_equal(pipeline: Pipeline) -> None:
    """In a stage in which something else moves, out of sight."""
    elsewhere = MOVING.replace("(-2, 0, 0)", "(-900, 0, 0)").replace("(2, 0, 0)", "(-900, 0, 1)")
    with_motion = _stage(STILL + '\n}\ndef Cube "far" {\n' + elsewhere)
    assert with_motion.read(1.0).moves
    images = [_beauty(pipeline, with_motion, 16, motion_blur=blur) for blur in (True, False)]
    np.testing.assert_array_equal(*images)


def _scene(**options: object) -> Scene:
    return _stage(MOVING, **options).read(1.0)  # type: ignore[arg-type]


def test_only_an_open_shutter_before_something_that_moves_costs_anything() -> None:
    settings = RenderSettings(size=(WIDTH, HEIGHT), samples=16)
    assert make_plan(_scene(), settings).moments == 16
    assert make_plan(_scene(shutter=(0.5, 0.5)), settings).moments == 0
    assert make_plan(_stage(STILL).read(1.0), settings).moments == 0
    assert make_plan(_stage(MOVING).read(None), settings).moments == 0
    assert make_plan(_scene(), RenderSettings(samples=1)).moments == 0
    assert make_plan(_scene(), RenderSettings(samples=16, motion_blur=False)).moments == 0


@pytest.mark.parametrize("samples", [2, 3, 16, 32, 33, 64, 100, 256, 1000])
def test_samples_share_the_moments_evenly(samples: int) -> None:
    plan = make_plan(_scene(), RenderSettings(samples=samples))
    assert plan.moments <= 32
    seen = [index // plan.samples_a_moment % plan.moments for index in range(min(samples, 256))]
    shares = np.bincount(seen, minlength=plan.moments)
    assert shares.min() >= 1 and shares.max() == plan.samples_a_moment
    assert shares.max() == 1 or samples > 32


@pytest.mark.parametrize("count", [1, 5, 16])
def test_times_are_the_middles_of_the_parts_of_the_shutter(count: int) -> None:
    times = Camera("/c", np.eye(4), (-1, 1, -1, 1), shutter=(-0.5, 0.5)).shutter_times(count)
    np.testing.assert_allclose(sorted(times), (np.arange(count) + 0.5) / count - 0.5)
    if count == 16:
        assert np.ptp(times[:4]) == 0.75  # the first quarter of them has seen all quarters


def test_unmoved_meshes_are_the_same_objects_at_every_moment() -> None:
    reader = _stage(MOVING)
    scene = reader.read(1.0)
    moments = reader.read_shutter(scene, 4)
    for _ in range(6):
        seen = next(moments)
        assert seen.meshes[0] is scene.meshes[0]
        assert seen.lights[0] is scene.lights[0]
        assert seen.frame == 1.0


def test_a_stage_on_disk_is_blurred(tmp_path: Path) -> None:
    path = tmp_path / "moving.usda"
    text = CAMERA.replace("OPEN", "0").replace("CLOSE", "1").replace("WHERE", FIXED) + QUAD.replace("WHERE", MOVING)
    path.write_text(f"#usda 1.0\n(timeCodesPerSecond = 24)\n{text}")
    sharp, blurred = (
        render(path, frame=1.0, size=(WIDTH, HEIGHT), samples=8, motion_blur=blur).layers["beauty"][4, :, 3]
        for blur in (False, True)
    )
    assert set(np.unique(sharp)) == {0.0, 1.0}
    assert len(np.unique(blurred)) > 4


BURST = """point3f[] points.timeSamples = {
        0: [(0, 0, 0), (0, 1, 0), (1, 1, 0)],
        1: [(0, -1, 0), (1, -1, 0), (1, 1, 0), (0, 1, 0)]
    }
    vector3f[] velocities.timeSamples = { 0: [(0, 0, 0)], 1: [(48, 0, 0), (48, 0, 0), (48, 0, 0), (48, 0, 0)] }
    int[] faceVertexCounts.timeSamples = { 0: [3], 1: [4] }
    int[] faceVertexIndices.timeSamples = { 0: [0, 1, 2], 1: [0, 1, 2, 3] }
"""


def test_what_velocities_carry_has_the_frames_topology_while_the_shutter_is_open() -> None:
    reader = _stage(BURST, shutter=(-0.5, 0.5))
    scene = reader.read(1.0)
    moments = reader.read_shutter(scene, 2)
    early, late = (next(moments).meshes[0].points for _ in range(2))
    np.testing.assert_allclose(early, scene.meshes[0].points - np.float32([0.5, 0, 0]), atol=1e-6)
    np.testing.assert_allclose(late, scene.meshes[0].points + np.float32([0.5, 0, 0]), atol=1e-6)


def test_copies_are_those_of_the_frame_while_the_shutter_is_open() -> None:
    text = """def PointInstancer "swarm" {
        rel prototypes = </swarm/cube>
        int[] protoIndices.timeSamples = { 0: [0], 1: [0, 0] }
        point3f[] positions.timeSamples = { 0: [(9, 9, 9)], 1: [(0, 0, 0), (4, 0, 0)] }
        vector3f[] velocities.timeSamples = { 0: [(0, 0, 0)], 1: [(24, 0, 0), (0, 0, 0)] }
        def Cube "cube" {
        }
    }"""
    camera = CAMERA.replace("OPEN", "-1").replace("CLOSE", "0").replace("WHERE", FIXED)
    reader = StageReader(stage_of(camera + text, "timeCodesPerSecond = 24"))
    (moment,) = next(reader.read_shutter(reader.read(1.0), 1)).drawables
    np.testing.assert_allclose(moment.world_from_object[:, :3, 3], [(-0.5, 0, 0), (4, 0, 0)], atol=1e-6)
