"""From camera space to what the GPU draws, and back."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from build import camera
from defshade_cli.passes.view import camera_depth, clip_from_camera, lens_offset
from defshade_cli.scene.camera import Camera

windows = st.tuples(*[st.floats(-50.0, 50.0)] * 2, *[st.floats(1e-3, 50.0)] * 2).map(
    lambda w: (w[0], w[0] + w[2], w[1], w[1] + w[3])
)
clips = st.tuples(st.floats(-6.0, 3.0), st.floats(0.5, 9.0)).map(lambda e: (10.0 ** e[0], 10.0 ** (e[0] + e[1])))
projections = st.sampled_from(["perspective", "orthographic"])
shares = st.floats(0.0, 1.0)


@given(windows, clips, projections, shares, shares, shares)
def test_what_the_window_frames_is_what_clip_space_holds(
    window: tuple[float, float, float, float],
    clip: tuple[float, float],
    projection: str,
    across: float,
    up: float,
    deep: float,
) -> None:
    """A place in the frustum, by its shares of the window and, in powers, of the way from near to far."""
    view = camera(projection=projection)
    depth = clip[0] * (clip[1] / clip[0]) ** deep
    spread = depth if projection == "perspective" else 1.0
    x = spread * (window[0] + across * (window[1] - window[0]))
    y = spread * (window[2] + up * (window[3] - window[2]))
    projected = clip_from_camera(view, window, clip, standard=False) @ (x, y, -depth, 1.0)
    ndc = projected / projected[3]
    size = max(map(abs, window)) / min(window[1] - window[0], window[3] - window[2])
    np.testing.assert_allclose(ndc[:2], (2.0 * across - 1.0, 2.0 * up - 1.0), atol=1e-12 * (1.0 + size))
    assert -1e-9 <= ndc[2] <= 1.0 + 1e-9


@given(clips, projections, st.booleans(), shares)
def test_depth_comes_back(clip: tuple[float, float], projection: str, standard: bool, deep: float) -> None:
    """Reversed depth holds seven digits however far; the standard one loses what near over far says."""
    view = camera(projection=projection)
    depth = clip[0] * (clip[1] / clip[0]) ** deep
    projected = clip_from_camera(view, (-1.0, 1.0, -1.0, 1.0), clip, standard) @ (0.0, 0.0, -depth, 1.0)
    found = camera_depth(view, clip, standard, np.array([projected[2] / projected[3]]))
    if np.isfinite(found[0]):
        lost = clip[1] / clip[0] if standard == (projection == "perspective") or projection == "orthographic" else 1.0
        np.testing.assert_allclose(found[0], depth, rtol=1e-9 + 1e-14 * lost)
    else:
        assert deep > 0.999 or projected[2] / projected[3] == (1.0 if standard else 0.0)


@given(shares, shares, st.floats(0.1, 64.0), st.floats(0.01, 10.0))
def test_a_lens_is_a_disk(u: float, v: float, f_stop: float, focal_length: float) -> None:
    view = Camera("/eye", np.eye(4), (-1, 1, -1, 1), f_stop=f_stop, focus_distance=5.0, focal_length=focal_length)
    offset = lens_offset(view, (u, v))
    radius = 0.5 * focal_length / f_stop
    assert np.hypot(*offset[:2]) <= radius * (1.0 + 1e-12)
    assert offset[2] == 0.0
    edge = max(abs(2.0 * u - 1.0), abs(2.0 * v - 1.0))  # concentric squares become concentric circles
    np.testing.assert_allclose(np.hypot(*offset[:2]), radius * edge, rtol=1e-9, atol=1e-15)
