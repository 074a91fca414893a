"""Layouts of skies: each shows every direction where its description says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from defshade_cli.image.environment import sky_of
from defshade_cli.image.projections import _on_ball, _on_disc, latlong_from
from defshade_cli.scene.environment import SkyLayout
from defshade_cli.scene.light import DomeLight
from stages import read, reasons

SIZE = 96
Place = Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]]


def directions(height: int) -> NDArray[np.float64]:
    """(height, 2 height, 3) of OpenEXR's map: centre +Z, a quarter from the left +X, top +Y."""
    v, h = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(2 * height) + 0.5) / (2 * height), indexing="ij")
    latitude, longitude = np.pi * (0.5 - v), 2 * np.pi * (0.5 - h)
    return np.stack(
        [np.sin(longitude) * np.cos(latitude), np.sin(latitude), np.cos(longitude) * np.cos(latitude)], axis=-1
    )


def colours(d: NDArray[np.float64]) -> NDArray[np.float32]:
    """A smooth colour for each direction, none alike."""
    return (0.5 + 0.5 * d).astype(np.float32)


def ball() -> NDArray[np.float32]:
    """What an orthographic eye on +Z sees in a mirroring ball: the ray reflected at the normal."""
    x, y = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE * 2 - 1, 1 - (np.arange(SIZE) + 0.5) / SIZE * 2)
    normal = np.stack([x, y, np.sqrt(np.maximum(1 - x * x - y * y, 0))], axis=-1)
    ray = np.array([0.0, 0.0, -1.0])
    return colours(ray - 2 * (normal @ ray)[..., None] * normal)


def angular() -> NDArray[np.float32]:
    x, y = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE * 2 - 1, 1 - (np.arange(SIZE) + 0.5) / SIZE * 2)
    r, turn = np.hypot(x, y) * np.pi, np.arctan2(y, x)
    return colours(np.stack([np.sin(r) * np.cos(turn), np.sin(r) * np.sin(turn), np.cos(r)], axis=-1))


def cross() -> NDArray[np.float32]:
    """Six pinhole views from within, each turned to meet its neighbours."""
    side = SIZE // 4
    image = np.zeros((4 * side, 3 * side, 3), np.float32)
    x, y = np.meshgrid((np.arange(side) + 0.5) / side * 2 - 1, (np.arange(side) + 0.5) / side * 2 - 1)
    for column, row, view in [
        (1, 1, lambda: (-x, -y, 1 + 0 * x)),
        (0, 1, lambda: (1 + 0 * x, -y, x)),
        (2, 1, lambda: (-1 + 0 * x, -y, -x)),
        (1, 0, lambda: (-x, 1 + 0 * x, y)),
        (1, 2, lambda: (-x, -1 + 0 * x, -y)),
        (1, 3, lambda: (-x, y, -1 + 0 * x)),
    ]:
        d = np.stack(view(), axis=-1)
        d /= np.linalg.norm(d, axis=-1, keepdims=True)
        image[row * side : (row + 1) * side, column * side : (column + 1) * side] = colours(d)
    return image


@pytest.mark.parametrize(
    ("image", "layout"), [(ball(), "mirroredBall"), (angular(), "angular"), (cross(), "cubeMapVerticalCross")]
)
def test_every_direction_is_where_the_layout_shows_it(image: NDArray[np.float32], layout: SkyLayout) -> None:
    """A texel of these small pictures is up to 5° wide; towards the rim, which is one direction, balls know less."""
    sky = latlong_from(image, layout)
    d = directions(len(sky))
    known = d[..., 2] > -0.9 if layout != "cubeMapVerticalCross" else np.ones(d.shape[:2], bool)
    np.testing.assert_allclose(sky[known], colours(d)[known], atol=0.05)
    np.testing.assert_allclose(sky.mean(axis=(0, 1)), colours(d).mean(axis=(0, 1)), atol=0.02)


coordinates = st.floats(-1.0, 1.0)


@pytest.mark.parametrize("place_of", [_on_ball, _on_disc])
@given(coordinates, coordinates, coordinates)
def test_any_direction_has_its_place_in_the_disc(place_of: Place, x: float, y: float, z: float) -> None:
    """And another place is another direction: the way back gives it again."""
    d = np.array((x, y, z))
    length = float(np.linalg.norm(d))
    if length < 1e-3 or z < -0.999 * length:  # the rim is one direction
        return
    d = d / length
    u, v = place_of(d)
    across, up = 2.0 * float(u) - 1.0, 1.0 - 2.0 * float(v)
    assert across**2 + up**2 <= 1.0 + 1e-9
    if place_of is _on_ball:
        normal = np.array((across, up, np.sqrt(max(1.0 - across**2 - up**2, 0.0))))
        back = 2.0 * normal[2] * normal - np.array((0.0, 0.0, 1.0))
    else:
        turn, r = np.arctan2(up, across), np.pi * np.hypot(across, up)
        back = np.array((np.sin(r) * np.cos(turn), np.sin(r) * np.sin(turn), np.cos(r)))
    np.testing.assert_allclose(back, d, atol=1e-6)


def test_automatic_tells_a_cross_by_its_shape() -> None:
    np.testing.assert_array_equal(latlong_from(cross(), "automatic"), latlong_from(cross(), "cubeMapVerticalCross"))
    image = np.zeros((8, 16, 3), np.float32)
    assert latlong_from(image, "automatic") is image and latlong_from(image, "latlong") is image


def test_a_dome_reads_its_format(tmp_path: Path) -> None:
    assert oiio.ImageBuf(np.ascontiguousarray(angular())).write(str(tmp_path / "sky.exr"), "float")
    body = "asset inputs:texture:file = @{}@\ntoken inputs:texture:format = {}"
    text = "".join(
        f'def DomeLight "{name}" {{\n{body.format(tmp_path / "sky.exr", quoted)}\n}}\n'
        for name, quoted in (("angular", '"angular"'), ("odd", '"dodecahedron"'))
    )
    found = read('def Cube "cube" {\n}\n' + text)
    dome, odd = found.lights
    assert isinstance(dome, DomeLight) and dome.layout == "angular"
    assert sky_of(dome).radiance.shape == (SIZE, 2 * SIZE, 3)
    np.testing.assert_allclose(sky_of(dome).radiance[SIZE // 2, SIZE // 2], [1, 0.5, 0.5], atol=0.05)
    assert isinstance(odd, DomeLight) and odd.layout == "automatic"
    assert reasons(found, "/odd") == ["there is no texture format dodecahedron: automatic is taken"]
