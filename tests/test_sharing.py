"""What stays one object from frame to frame, and what is moved by velocities between samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from defshade_cli.gpu import vertex_pool
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.settings import RenderSettings
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.polygons import cut as cutting
from defshade_cli.usd.polygons import refiner
from defshade_cli.usd.reader import StageReader
from defshade_cli.usd.sharing import shared
from defshade_cli.usd.surfaces import shape
from stages import read, stage_of

GRID = """def Mesh "grid" {
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
    point3f[] points.timeSamples = {
        0: [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)],
        5: [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)],
        10: [(0, 0, 1), (1, 0, 0), (2, 0, 1), (0, 1, 1), (1, 1, 0), (2, 1, 1)]
    }
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0), (1, 0), (1, 1), (0, 1)] (
        interpolation = "faceVarying"
    )
    uniform token subdivisionScheme = "SCHEME"
}
"""


@dataclass(frozen=True, eq=False)
class _Pair:
    values: NDArray
    name: str
    parts: dict[str, NDArray]


def test_equal_parts_become_one_object() -> None:
    old = _Pair(np.arange(3.0), "a", {"x": np.zeros(2)})
    assert shared(_Pair(np.arange(3.0), "a", {"x": np.zeros(2)}), old) is old
    changed = shared(_Pair(np.arange(3.0), "b", {"x": np.zeros(2), "y": np.ones(1)}), old)
    assert changed.name == "b" and changed.values is old.values and changed.parts["x"] is old.parts["x"]
    assert shared(np.array([np.nan]), None) is not None
    nan = np.array([np.nan, 1.0])
    assert shared(nan.copy(), nan) is nan
    assert shared(np.zeros(2, np.float32), nan) is not nan


@pytest.mark.parametrize("scheme", ["none", "catmullClark"])
def test_moving_points_are_all_that_is_made_anew(scheme: str, monkeypatch: pytest.MonkeyPatch) -> None:
    reader = StageReader(stage_of(GRID.replace("SCHEME", scheme)), ReadOptions(complexity="medium"))
    (first,) = reader.read(0).meshes
    with monkeypatch.context() as patched:
        for module, name in ((cutting, "triangulate"), (shape, "read_mesh"), (refiner, "refine")):
            patched.setattr(module, name, lambda *_: pytest.fail("made again"))
        (held,), (moved,) = reader.read(3).meshes, reader.read(10).meshes
    assert held is first
    assert moved is not first
    assert np.shares_memory(moved.triangles, first.triangles)
    assert np.shares_memory(moved.uvs["st"], first.uvs["st"])
    fresh = read(GRID.replace("SCHEME", scheme), 10, complexity="medium").meshes[0]
    np.testing.assert_array_equal(moved.points, fresh.points)
    np.testing.assert_array_equal(moved.normals, fresh.normals)
    np.testing.assert_array_equal(moved.triangles, fresh.triangles)


def test_a_topology_that_changes_is_cut_again() -> None:
    text = GRID.replace("SCHEME", "none").replace(
        "int[] faceVertexIndices =", "int[] faceVertexIndices.timeSamples = { 10: [1, 2, 5, 4, 0, 1, 4, 3], 0:"
    )
    text = text.replace("4, 3, 1, 2, 5, 4]\n    point", "4, 3, 1, 2, 5, 4] }\n    point")
    reader = StageReader(stage_of(text))
    reader.read(0)
    np.testing.assert_array_equal(reader.read(10).meshes[0].triangles, read(text, 10).meshes[0].triangles)


# Velocities

FALLING = """def Mesh "drop" {
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points.timeSamples = { 0: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], 10: [(9, 9, 9), (9, 9, 9), (9, 9, 9)] }
    vector3f[] velocities.timeSamples = { 0: [(24, 0, 0), (24, 0, 0), (48, 0, 0)], 10: [(0, 0, 0)] }
    ACCELERATIONS
    uniform token subdivisionScheme = "none"
}
"""
PER_SECOND = "timeCodesPerSecond = 24"


def test_points_move_on_from_their_last_sample_by_velocities() -> None:
    """Not half way to the next sample, but 5 time codes of 1/24 s at 24 and 48 units a second."""
    points = read(FALLING.replace("ACCELERATIONS", ""), 5, PER_SECOND).meshes[0].points
    np.testing.assert_allclose(points, [(5, 0, 0), (6, 0, 0), (10, 1, 0)], atol=1e-6)


def test_accelerations_bend_the_way() -> None:
    """½ a t² with t = 5/24 s."""
    bent = "vector3f[] accelerations.timeSamples = { 0: [(0, -10, 0), (0, 0, 0), (0, 0, 0)], 10: [(0, 0, 0)] }"
    text = FALLING.replace("ACCELERATIONS", bent)
    points = read(text, 5, PER_SECOND).meshes[0].points
    np.testing.assert_allclose(points[0], (5, -5 * (5 / 24) ** 2, 0), atol=1e-6)


def test_a_single_sample_with_velocities_varies() -> None:
    text = FALLING.replace("ACCELERATIONS", "").replace(", 10: [(9, 9, 9), (9, 9, 9), (9, 9, 9)]", "")
    text = text.replace(", 10: [(0, 0, 0)]", "")
    reader = StageReader(stage_of(text, PER_SECOND))
    near, far = (reader.read(frame).meshes[0].points[0] for frame in (1, 3))
    np.testing.assert_allclose([near, far], [(1, 0, 0), (3, 0, 0)], atol=1e-6)


def test_copies_of_a_point_instancer_move_and_turn_by_velocities() -> None:
    text = """def PointInstancer "swarm" {
        rel prototypes = </swarm/cube>
        int[] protoIndices = [0]
        point3f[] positions.timeSamples = { 0: [(0, 0, 0)], 10: [(9, 9, 9)] }
        vector3f[] velocities.timeSamples = { 0: [(24, 0, 0)], 10: [(0, 0, 0)] }
        quath[] orientations.timeSamples = { 0: [(1, 0, 0, 0)], 10: [(1, 0, 0, 0)] }
        vector3f[] angularVelocities.timeSamples = { 0: [(0, 0, 216)], 10: [(0, 0, 0)] }
        def Cube "cube" {
        }
    }"""
    (drawable,) = read(text, 5, PER_SECOND).drawables
    matrix = drawable.world_from_object[0]
    np.testing.assert_allclose(matrix[:3, 3], (5, 0, 0), atol=1e-6)
    half = np.sqrt(0.5)
    # Orientations are halfs: 216° a second for 5/24 s are 45°.
    np.testing.assert_allclose(matrix[:2, :2], [(half, -half), (half, half)], atol=1e-3)


def test_only_the_mesh_that_moved_is_uploaded(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """And the picture is the one of a renderer that has seen nothing before."""
    text = GRID.replace("SCHEME", "none") + 'def Cube "still" {\n}\n'
    reader, settings = StageReader(stage_of(text)), RenderSettings(size=(64, 36))
    scenes = [reader.read(frame) for frame in (0, 10)]
    plans = [make_plan(scene, settings) for scene in scenes]
    fresh = Pipeline(gpu).render(scenes[1], plans[1]).layers["beauty"]
    pipeline = Pipeline(gpu)
    pipeline.render(scenes[0], plans[0])
    uploaded: list[str] = []
    arrays_of = vertex_pool.vertex_arrays
    monkeypatch.setattr(
        vertex_pool,
        "vertex_arrays",
        lambda meshes, *a, **k: uploaded.extend(m.path for m in meshes) or arrays_of(meshes, *a, **k),
    )
    again = pipeline.render(scenes[1], plans[1]).layers["beauty"]
    assert uploaded == ["/grid"]
    np.testing.assert_array_equal(again, fresh)
