"""Coarser triangles, and shadow maps in which they stand for dense meshes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from build import at, beauty, bulb, camera, drawable, quad, rotated, scene, sphere, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.residence import GpuScene
from defshade_cli.passes.coarse_maps import coarse_levels
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import coarse_casters, make_plan
from defshade_cli.scene import coarse
from defshade_cli.scene.closed import is_closed
from defshade_cli.scene.coarse import coarse_triangles
from defshade_cli.scene.geometry import Mesh
from defshade_cli.scene.light import DomeLight, Light
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings

pytest.importorskip("meshoptimizer")

LEVEL = -7
"""A length of 0.0078 in shapes of about 1."""

MOST_OFF = 4.0
"""Times a level's length: meshoptimizer's error is a mean over the planes around a point."""

BALL = sphere(1.0, rings=160)

Shape = tuple[NDArray[np.float64], NDArray[np.intp]]


def patch(columns: int, rows: int, of: Callable[[NDArray, NDArray], list[NDArray]]) -> Shape:
    """Of (u, v) in the unit square."""
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows), indexing="ij")
    number = np.arange(columns * rows).reshape(columns, rows)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return np.stack(np.broadcast_arrays(*of(u.ravel(), v.ravel())), axis=1), triangles


def box(*size: float) -> Shape:
    """Closed, of six patches that share no points, turned out of the axes."""
    (square, faces), points, triangles = patch(32, 32, lambda u, v: [u, v]), [], []
    for axis in range(3):
        for end in (0, 1):
            placed = np.insert(square, 0, end, axis=1)[:, [-axis % 3, (1 - axis) % 3, (2 - axis) % 3]]
            triangles.append((faces if end else faces[:, ::-1]) + len(points) * len(square))
            points.append(placed * size)
    turn = (rotated("x", 30.0) @ rotated("z", 20.0))[:3, :3]
    return np.concatenate(points) @ turn.T, np.concatenate(triangles)


def tube(radius: float) -> Shape:
    """Bent, and open at its ends."""

    def of(u: NDArray, v: NDArray) -> list[NDArray]:
        angle = 2.0 * np.pi * u
        return [np.sin(3.0 * v) + radius * np.cos(angle), 2.0 * v, np.cos(3.0 * v) + radius * np.sin(angle)]

    return patch(24, 400, of)


def mesh_of(shape: Shape) -> Mesh:
    points, triangles = shape
    return Mesh("/shape", points, np.zeros_like(points), triangles, np.zeros(len(triangles)))


def strewn(points: NDArray, triangles: NDArray, apart: float) -> tuple[NDArray, NDArray]:
    """Points on triangles, about so far apart, and the triangle of each."""
    a, b, c = (points[corner] for corner in triangles.T)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
    of = np.repeat(np.arange(len(triangles)), np.ceil(area / apart**2).astype(int) + 3)
    u, v = np.random.default_rng(0).random((2, len(of), 1))
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    return a[of] + u * (b - a)[of] + v * (c - a)[of], of


def most_apart(mesh: Mesh, coarser: NDArray) -> float:
    """Of points of either surface from the other, by points strewn over both; too large by how far those are apart."""
    apart = 2.0**LEVEL / 4.0
    points = mesh.points.astype(np.float64)
    one, other = (strewn(points, triangles, apart)[0] for triangles in (mesh.triangles, coarser))
    corners = points[np.unique(mesh.triangles)], points[np.unique(coarser)]
    one, other = np.concatenate([one, corners[0]]), np.concatenate([other, corners[1]])
    return float(max(cKDTree(one).query(other)[0].max(), cKDTree(other).query(one)[0].max()))


@pytest.mark.parametrize(
    "shape",
    [
        pytest.param(patch(100, 100, lambda u, v: [u, v, 0.05 * np.sin(9 * u) * np.sin(9 * v)]), id="waves"),
        pytest.param(patch(100, 100, lambda u, v: [u, v, 0.2 * np.exp(-2e3 * ((u - 0.5) ** 2 + v**2))]), id="spike"),
        pytest.param(box(1.0, 1.0, 1.0), id="box"),
        pytest.param(box(1.0, 1.0, 1e-4), id="sheet"),
        pytest.param(box(1.0, 3e-3, 3e-3), id="bar"),
        pytest.param(tube(0.1), id="tube"),
        pytest.param((sphere(0.5, 64).points, sphere(0.5, 64).triangles), id="ball"),
    ],
)
def test_no_point_is_far_off(shape: Shape) -> None:
    """Nor is any of a sheet or a bar that are thinner than the length; what is closed stays so."""
    mesh = mesh_of(shape)
    coarser = coarse_triangles(mesh, LEVEL)
    assert coarser is not None and 0 < len(coarser) < 0.5 * len(mesh.triangles)
    assert most_apart(mesh, coarser) < MOST_OFF * 2.0**LEVEL
    assert is_closed(mesh.points, coarser) == mesh.is_closed


def test_a_wire_stays_as_it_is() -> None:
    """As thin as the length it would become wider or vanish, and so would its shadow."""
    assert coarse_triangles(mesh_of(tube(0.25 * 2.0**LEVEL)), LEVEL) is None


def test_what_cannot_be_coarser_stays_as_it_is() -> None:
    mesh = BALL
    assert coarse_triangles(mesh, -24) is None
    broken = mesh.points.copy()
    broken[5] = np.nan
    assert coarse_triangles(replace(mesh, points=broken), LEVEL) is None


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Iterator[Pipeline]:
    yield Pipeline(gpu)


def sky() -> DomeLight:
    return DomeLight(path="/dome", world_from_light=np.eye(4), color=(1, 1, 1))


def standing(*lights: Light) -> Scene:
    """Dense balls that touch a floor, and one above."""
    of = scene([BALL, quad(4.0, -1.0)], lights, view=camera(6.0))
    where = [at(-0.8, 0, 0) @ rotated("x", 40.0), at(0.8, 0, -0.4) @ np.diag([0.6, 0.6, 0.6, 1.0])]
    return replace(of, drawables=(drawable(BALL, 0, where=where), *of.drawables[1:]))


def test_the_plan_says_what_is_coarser(monkeypatch: pytest.MonkeyPatch) -> None:
    """Dense solid meshes under many maps, off by less as samples grow."""
    of, settings = standing(sky()), RenderSettings(size=(8, 8))
    plan = make_plan(of, settings)
    assert plan.coarse == (0,)
    said = {d.subject: d for d in plan.decisions}["coarser casters"]
    assert said.choice == "1 in shadow maps" and "1/16 of a map's texel" in said.reason
    assert make_plan(of, replace(settings, samples=16)).coarse_share == plan.coarse_share / 4.0
    assert make_plan(standing(sun()), settings).coarse == ()
    thin = replace(of, materials=tuple(replace(m, opacity=0.5) for m in of.materials))
    assert make_plan(thin, settings).coarse == ()
    monkeypatch.setattr(coarse, "find_spec", lambda name: None)
    without = make_plan(of, settings)
    assert without.coarse == () and ("none", coarse.INSTALL) in {(d.choice, d.reason) for d in without.decisions}


def test_levels_follow_texels(gpu: Gpu) -> None:
    """Of parallel maps the least side; before an eye they widen; around one nothing coarser will do."""
    of = standing(sky())
    draws = GpuScene(gpu).update(of, coarse=(0,))
    parallel, ahead, amid = replace(camera(0.0, 2.0), projection="orthographic"), camera(0.0, 2.0), camera(-6.0, 2.0)
    nearest = 6.0 - of.drawable_bounds[0, 1, 2]
    found = coarse_levels(draws, [parallel, ahead, amid], 64, 1.0)
    np.testing.assert_array_equal(found[:, 0], [-4.0, np.floor(np.log2(4.0 * nearest / 64)), -np.inf])
    assert (coarse_levels(draws, [parallel], 64, 0.0) == -np.inf).all()


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize(
    "light",
    [sky(), replace(bulb(0.4, 1.0, 3.0), radius=0.5), replace(bulb(0.0, 2.0, -0.3), radius=0.2)],
    ids=["dome", "bulb", "bulb amid"],
)
def test_shadows_are_those_of_all_triangles(
    pipeline: Pipeline, light: Light, samples: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But for edges: no light comes under what touches the floor, no shadow on the balls."""
    monkeypatch.setattr(coarse_casters, "_LEAST_MAPS", 2)
    of = standing(light)
    plan = make_plan(of, RenderSettings(size=(96, 96), samples=samples))
    coarser, whole = (beauty(pipeline.render(of, each).layers) for each in (plan, replace(plan, coarse=())))
    assert plan.coarse and (coarser != whole).any()
    np.testing.assert_allclose(coarser.mean(), whole.mean(), rtol=1e-3)
    error = (coarser - whole) ** 2 / (whole**2 + 1e-2)
    assert error.mean() < 1e-4
    assert (error > 1e-2).mean() < 2e-3
