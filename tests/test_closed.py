"""Closed meshes, and shadow maps that show their fronts alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from build import at, beauty, bulb, camera, drawable, quad, rotated, scene, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.closed import is_closed
from defshade_cli.scene.geometry import Mesh
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings

SIDE = 24  # 1152 triangles


def ring(side: int = SIDE, hole: float = 0.5) -> tuple[NDArray, NDArray, NDArray]:
    """Points, normals and triangles of a torus around Z, within a radius of 1."""
    turn = np.arange(side) * 2.0 * np.pi / side
    along, across = (a.ravel() for a in np.meshgrid(turn, turn, indexing="ij"))
    thick, middle = (1.0 - hole) / 2.0, (1.0 + hole) / 2.0
    outwards = np.stack([np.cos(along), np.sin(along), np.zeros_like(along)], axis=-1)
    normals = np.cos(across)[:, None] * outwards + np.sin(across)[:, None] * [0.0, 0.0, 1.0]
    i, j = (a.ravel() for a in np.meshgrid(np.arange(side), np.arange(side), indexing="ij"))
    here, there = i * side + j, i * side + (j + 1) % side
    beyond = (i + 1) % side * side
    one, other = np.stack([here, beyond + j, beyond + (j + 1) % side]), np.stack([here, beyond + (j + 1) % side, there])
    return middle * outwards + thick * normals, normals, np.concatenate([one.T, other.T])


def torus(name: str = "/torus") -> Mesh:
    points, normals, triangles = ring()
    return Mesh(name, points, normals, triangles, np.arange(len(triangles)))


@given(st.integers(3, 12), st.randoms(use_true_random=False))
def test_a_ring_is_closed_however_its_corners_are_shared(side: int, random: object) -> None:
    """And opens with any triangle that is taken out, turned over, or drawn from another corner."""
    points, _, triangles = ring(side)
    points, triangles = points.astype(np.float32), triangles.astype(np.uint32)
    assert is_closed(points, triangles)
    assert is_closed(points[triangles.ravel()], np.arange(triangles.size, dtype=np.uint32).reshape(-1, 3))
    chosen = random.randrange(len(triangles))  # type: ignore[attr-defined]
    assert not is_closed(points, np.delete(triangles, chosen, axis=0))
    turned, moved = triangles.copy(), triangles.copy()
    turned[chosen] = turned[chosen, ::-1]
    moved[chosen, 0] = (moved[chosen] + 1).max() % len(points)
    assert not is_closed(points, turned) and not is_closed(points, moved)


def test_points_that_are_not_finite_close_nothing() -> None:
    points, _, triangles = ring(4)
    points[3, 1] = np.nan
    assert not is_closed(points.astype(np.float32), triangles.astype(np.uint32))


def test_zeros_of_either_sign_are_one_point() -> None:
    points, _, triangles = ring(4)
    apart = np.round(points, 12)[triangles.ravel()].astype(np.float32)
    apart[::2][apart[::2] == 0.0] = -0.0
    assert is_closed(apart, np.arange(len(apart), dtype=np.uint32).reshape(-1, 3))


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Iterator[Pipeline]:
    yield Pipeline(gpu)


def test_the_plan_says_whose_backs_are_skipped() -> None:
    """Large closed meshes under many maps; not what is open, or lets light through."""
    of = scene([torus(), quad(4.0, -1.5)], [bulb(0, 0, 3)], view=camera(6.0))
    plan = make_plan(of, RenderSettings(size=(8, 8), samples=8))
    assert plan.closed == (0,)
    assert ("backs of casters", "skipped of 1") in [(d.subject, d.choice) for d in plan.decisions]
    assert make_plan(of, RenderSettings(size=(8, 8), light_points=1)).closed == ()
    assert make_plan(of, RenderSettings(size=(8, 8), samples=8, shadows=False)).closed == ()
    thin = replace(of, materials=tuple(replace(m, opacity=0.5) for m in of.materials))
    assert make_plan(thin, RenderSettings(size=(8, 8), samples=8)).closed == ()


def pictures(pipeline: Pipeline, of: Scene) -> tuple[NDArray, NDArray]:
    """With fronts alone, where the plan skips backs, and with both sides."""
    plan = make_plan(of, RenderSettings(size=(48, 48), samples=8))
    assert plan.closed
    return tuple(beauty(pipeline.render(of, each).layers) for each in (plan, replace(plan, closed=())))  # type: ignore


@pytest.mark.parametrize("mirrored", [1.0, -1.0])
@pytest.mark.parametrize("light", [bulb(0.4, 1.0, 3.0), bulb(0, 0, 0), sun()], ids=["bulb", "bulb in the hole", "sun"])
def test_fronts_shade_as_both_sides_do(pipeline: Pipeline, light: object, mirrored: float) -> None:
    """But for texels that an edge crosses: no pixel by more than a hundredth of the brightest."""
    where = rotated("x", 30.0) @ np.diag([mirrored, 1.0, 1.0, 1.0])
    of = scene([torus(), quad(4.0, -1.5)], [light], view=camera(6.0))  # type: ignore[list-item]
    of = replace(of, drawables=(drawable(torus(), 0, where=[where]), *of.drawables[1:]))
    fronts, both = pictures(pipeline, of)
    assert fronts.max() > 0.0
    np.testing.assert_allclose(fronts, both, atol=0.01 * both.max())


def test_a_light_within_keeps_backs(pipeline: Pipeline) -> None:
    """Of the tube that it is in: none of its light comes out."""
    of = scene([torus(), quad(4.0, -1.5)], [replace(bulb(0.75, 0.0, 0.0), radius=0.05)], view=camera(6.0))
    fronts, both = pictures(pipeline, of)
    np.testing.assert_array_equal(fronts, both)
    unshadowed = pipeline.render(of, make_plan(of, RenderSettings(size=(48, 48), shadows=False)))
    assert fronts.mean() < 0.1 * beauty(unshadowed.layers).mean()


def test_placements_of_either_hand_in_one_draw_keep_their_backs(pipeline: Pipeline) -> None:
    of = scene([torus(), quad(4.0, -1.5)], [bulb(0.4, 1.0, 3.0)], view=camera(6.0))
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    of = replace(of, drawables=(drawable(torus(), 0, where=[at(-1, 0, 0), at(1, 0, 0) @ mirror]), *of.drawables[1:]))
    np.testing.assert_array_equal(*pictures(pipeline, of))
