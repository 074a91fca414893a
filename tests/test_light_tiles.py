"""Lights by tiles or on the whole image: the picture of the volumes, and lists that miss no light."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from build import bulb, quad, scene, sun
from defshade_cli import render
from defshade_cli.passes import hidden_lights
from defshade_cli.passes.hidden_lights import HiddenLights
from defshade_cli.passes.light_lists import TILE, list_lights, tile_boxes
from defshade_cli.passes.screen import regions_of
from defshade_cli.plan import make_plan
from defshade_cli.plan.bounds import LightBounds
from defshade_cli.plan.cost import covered_share
from defshade_cli.settings import LIGHTINGS, RenderSettings

SCENES = [
    "showcase",
    "camera_orthographic",
    "light_cone",
    "light_dome",
    "light_ies",
    "light_linking",
    "light_many",
    "light_mesh",
    "materials",
]
HIDING = ["light_cone", "light_distant", "light_dome", "light_many"]
WINDOW = np.array([-0.8, 0.6, -0.5, 0.45])
SIZE = (5 * TILE - 7, 3 * TILE + 1)


def differences(
    stage: Path, names: Sequence[str] = ("beauty",), **options: Any
) -> Iterator[tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """The layers by volumes, and the same by tiles and on the whole image."""
    options = {"size": (150, 70), "layers": names, **options}
    volumes, *others = (render(stage, lighting=kind, **options).layers for kind in LIGHTINGS[1:])
    return ((volumes[name], other[name]) for other in others for name in names)


@pytest.mark.parametrize("name", SCENES)
def test_the_picture_is_that_of_the_volumes(name: str, scenes: Path) -> None:
    """But for the order in which floats are added: 35 lights of the showcase, 6e-8 each."""
    for volumes, other in differences(scenes / f"{name}.usda"):
        np.testing.assert_allclose(other, volumes, rtol=35 * 6e-8, atol=1e-7)


@pytest.mark.parametrize("name", HIDING)
def test_lights_that_do_not_arrive_are_left_out_of_no_pixel(
    name: str, scenes: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To the bit, also where a sample moves the eye and the map."""
    shares, find = [], HiddenLights.find
    monkeypatch.setattr(HiddenLights, "find", lambda *told: (found := find(*told), shares.append(found.mean()))[0])
    for options in ({}, {"samples": 2, "layout": "packed"}):
        pictures = []
        for worthwhile in (np.inf, 0.0):
            monkeypatch.setattr(hidden_lights, "_WORTHWHILE", worthwhile)
            film = render(scenes / f"{name}.usda", size=(150, 70), lighting="tiles", **options)
            pictures.append(film.layers["beauty"])
        np.testing.assert_array_equal(*pictures)
    assert max(shares) > 0.0


@pytest.mark.parametrize("options", [{"samples": 3}, {"layout": "rgba8"}, {"shading": "classic"}, {"shadows": False}])
def test_so_it_is_with_every_option(options: dict[str, Any], scenes: Path) -> None:
    for volumes, other in differences(scenes / "showcase.usda", **options):
        np.testing.assert_allclose(other, volumes, rtol=35 * 6e-8, atol=1e-7)


def test_layers_of_parts_of_the_light_are_the_same(scenes: Path) -> None:
    names = ("diffuse", "specular", "shadow", "light:default")
    for volumes, other in differences(scenes / "showcase.usda", names, size=(96, 54)):
        np.testing.assert_allclose(other, volumes, rtol=1e-5, atol=1e-6)


def test_samples_of_a_sky_are_the_same(scenes: Path) -> None:
    for volumes, other in differences(scenes / "light_dome.usda", samples=4):
        np.testing.assert_allclose(other, volumes, rtol=1e-5, atol=1e-6)


def test_finished_tiles_stay_as_they_are(scenes: Path) -> None:
    options = {"size": (96, 64), "samples": 32, "max_error": 0.05, "shadows": False}
    for volumes, other in differences(scenes / "light_cone.usda", **options):
        np.testing.assert_allclose(other, volumes, rtol=1e-5, atol=1e-6)


numbers = st.floats(-3.0, 3.0)
lights = st.tuples(
    st.tuples(numbers, numbers, st.floats(-9.0, 3.0)),
    st.floats(0.01, 4.0) | st.just(math.inf),
    st.tuples(numbers, numbers, numbers).filter(lambda axis: max(map(abs, axis)) > 1e-3),
    st.floats(0.0, math.pi / 2) | st.just(2 * math.pi),
)


@settings(max_examples=200, deadline=None)
@given(st.lists(lights, min_size=1, max_size=12), st.integers(0, 2**32 - 1), st.booleans())
def test_a_tile_lists_every_light_that_reaches_a_pixel_of_it(chosen: list, seed: int, perspective: bool) -> None:
    """Against every pixel: its point within the reach and, where there is one, the cone."""
    centre, reach, axis, angle = (np.array(column, float) for column in zip(*chosen, strict=True))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    rng = np.random.default_rng(seed)
    depth = 1.0 + 6.0 * rng.random((SIZE[1], SIZE[0]))
    depth[rng.random(depth.shape) < 0.3] = np.nan
    lists = list_lights(
        LightBounds(centre, reach, axis, angle),
        tile_boxes(_ranges(depth), WINDOW, SIZE, perspective=perspective),
    )
    listed = np.zeros((len(chosen), 4, 5), bool)
    for row, column in np.ndindex(4, 5):
        first, count = lists.runs[row, column]
        run = lists.lights[first : first + count].astype(int)
        assert (np.diff(run) > 0).all()
        listed[run, row, column] = True
    lit = _lit(centre, reach, axis, angle, _points(depth, perspective))
    rows, columns = np.arange(SIZE[1]) // TILE, np.arange(SIZE[0]) // TILE
    assert not (lit & ~listed[:, rows][:, :, columns]).any()


def _points(depth: NDArray[np.float64], perspective: bool) -> NDArray[np.float64]:
    """(H, W, 3) in camera space."""
    x = WINDOW[0] + (np.arange(SIZE[0]) + 0.5) / SIZE[0] * (WINDOW[1] - WINDOW[0])
    y = WINDOW[3] - (np.arange(SIZE[1]) + 0.5) / SIZE[1] * (WINDOW[3] - WINDOW[2])
    scale = depth if perspective else np.ones_like(depth)
    return np.stack([x[None, :] * scale, y[:, None] * scale, -depth], axis=-1)


def _ranges(depth: NDArray[np.float64]) -> NDArray[np.float64]:
    padded = np.full((4 * TILE, 5 * TILE), np.nan)
    padded[: SIZE[1], : SIZE[0]] = depth
    tiles = padded.reshape(4, TILE, 5, TILE).swapaxes(1, 2).reshape(4, 5, -1)
    known = np.isfinite(tiles)
    return np.stack([np.where(known, tiles, 1e38).min(axis=-1), np.where(known, tiles, -1e38).max(axis=-1)], axis=-1)


def _lit(centre, reach, axis, angle, points):  # type: ignore[no-untyped-def]
    """(L, H, W) whether the pixel's point lies in the light's volume."""
    offset = points[None] - centre[:, None, None]
    distance = np.linalg.norm(offset, axis=-1)
    along = np.einsum("lhwi,li->lhw", offset, axis) / np.maximum(distance, 1e-30)
    bounded, cone = np.isfinite(reach)[:, None, None], angle[:, None, None]
    inside = ~bounded | (distance < reach[:, None, None])
    in_cone = ~bounded | (cone > math.pi / 2) | (np.arccos(np.clip(along, -1.0, 1.0)) < cone)
    return inside & in_cone & np.isfinite(points[..., 2])[None]


def test_lights_cover_what_they_reach() -> None:
    of = scene([quad(5.0)], [bulb(0, 0, 1.0), sun()])
    planned = make_plan(of, RenderSettings(size=SIZE, light_points=4)).lights
    assert covered_share(planned, of.camera) == 5.0
    assert covered_share([], of.camera) == 0.0


def test_one_light_is_a_volume_and_many_are_tiles_or_cover_the_image() -> None:
    of = scene([quad(5.0)], [bulb(0, 0, 1.0, intensity=1e-6)])
    assert make_plan(of, RenderSettings(size=SIZE, light_tolerance=1e-2)).lighting == "volumes"
    of = scene([quad(5.0)], [bulb(x, 0, 1.0) for x in range(3)])
    assert make_plan(of, RenderSettings(size=SIZE)).lighting == "tiles"
    assert make_plan(of, RenderSettings(size=(1920, 1080))).lighting == "whole"
    assert make_plan(of, RenderSettings(size=SIZE, layers=("lightComplexity",))).lighting == "volumes"
    assert make_plan(of, RenderSettings(size=SIZE, lighting="volumes")).lighting == "volumes"


@given(st.integers(1, 7), st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_regions_cover_the_tiles_and_no_others(rows: int, columns: int, seed: int) -> None:
    tiles = np.random.default_rng(seed).random((rows, columns)) < 0.6
    size = (columns * TILE - 5, rows * TILE - 9)
    covered = np.zeros((rows, columns), int)
    for left, top, right, bottom in regions_of(tiles, TILE, size) * np.array(size * 2) / TILE:
        covered[round(top) : math.ceil(bottom - 1e-3), round(left) : math.ceil(right - 1e-3)] += 1
    np.testing.assert_array_equal(covered, tiles)
