"""Culling by the view: nothing that may be seen is left out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from build import camera, drawable, quad, scene, sphere, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes import culling
from defshade_cli.passes.culling import may_see
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.passes.view import clip_from_camera
from defshade_cli.plan import make_plan
from defshade_cli.settings import RenderSettings
from defshade_cli.spaces import translation

coordinates = st.floats(-20.0, 20.0)


def corners_of(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


@settings(max_examples=300, deadline=None)
@given(
    st.tuples(coordinates, coordinates, coordinates),
    st.tuples(*[st.floats(0.0, 15.0)] * 3),
    st.sampled_from(["perspective", "orthographic"]),
    st.booleans(),
    st.integers(0, 2**32 - 1),
)
def test_a_box_with_a_point_in_the_frustum_is_kept(
    low: tuple[float, ...], size: tuple[float, ...], projection: str, standard: bool, seed: int
) -> None:
    """Against points all over the box."""
    view = camera(0.0, 0.7, projection=projection)
    clip = clip_from_camera(view, view.window, (0.1, 12.0), standard)
    corners = corners_of(np.array(low), np.array(low) + size)
    points = np.array(low) + np.random.default_rng(seed).random((500, 3)) * size
    seen = np.column_stack([points, np.ones(500)]) @ clip.T
    xyz, w = seen[:, :3], seen[:, 3:]
    inside = (np.abs(xyz[:, :2]) < w).all(axis=1) & (xyz[:, 2] > 0) & (xyz[:, 2] < w[:, 0])
    kept = may_see(clip.T.astype(np.float32), corners[None])
    assert kept[0] or not inside.any()


def test_what_is_far_off_the_view_is_culled_and_what_is_unknown_is_kept() -> None:
    view = camera(0.0, 0.7)
    clip = clip_from_camera(view, view.window, (0.1, 12.0), standard=False).T.astype(np.float32)
    boxes = [
        corners_of(np.array(p) - 1.0, np.array(p) + 1.0) for p in [(0, 0, -5), (0, 0, 5), (50, 0, -5), (0, 0, -50)]
    ]
    boxes.append(np.full((8, 3), math.nan))
    assert may_see(clip, np.array(boxes)).tolist() == [True, False, False, False, True]


@pytest.mark.parametrize("samples", [1, 4])
def test_the_picture_does_not_change_with_what_is_culled(gpu: Gpu, samples: int) -> None:
    """A ring of balls around the eye: most are behind it. Instances that share a mesh are drawn by one command."""
    pipeline = Pipeline(gpu)
    around = [translation(8.0 * np.array([math.sin(a), 0.0, math.cos(a)])) for a in np.linspace(0, 6, 12)]
    apart = scene(
        [sphere(1.0), quad(9.0, -9.0)],
        [sun()],
        drawables=[*(drawable(sphere(1.0), 0, where=[place]) for place in around), drawable(quad(9.0, -9.0), 1)],
    )
    together = scene(
        [sphere(1.0), quad(9.0, -9.0)],
        [sun()],
        drawables=[drawable(sphere(1.0), 0, where=around), drawable(quad(9.0, -9.0), 1)],
    )
    options = RenderSettings(size=(64, 48), samples=samples, layers=("beauty",))
    pictures = [pipeline.render(each, make_plan(each, options)).layers["beauty"] for each in (apart, together)]
    np.testing.assert_array_equal(*pictures)
    assert pictures[0][..., 3].mean() > 0.5


def test_commands_in_pieces_draw_what_they_draw_at_once(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """From all of them at once to one by one; some place their mesh several times."""
    meshes = [sphere(1.0, rings=6), quad(9.0, -9.0)]
    places = [[translation(np.array([i - 3.0, 0.2 * j, -j]))] for i in range(5) for j in range(2)]
    drawables = [drawable(meshes[0], 0, where=place * (1 + i % 3)) for i, place in enumerate(places)]
    lit = scene(meshes, [sun()], drawables=[*drawables, drawable(meshes[1], 1)])
    plan = make_plan(lit, RenderSettings(size=(64, 48), samples=2, layers=("beauty",)))
    pictures = []
    for most in (2**16, 300, 1):
        monkeypatch.setattr(culling, "_MOST_QUEUED", most)
        pictures.append(Pipeline(gpu).render(lit, plan).layers["beauty"])
    np.testing.assert_array_equal(pictures[1], pictures[0])
    np.testing.assert_array_equal(pictures[2], pictures[0])
