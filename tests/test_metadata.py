"""Headers: what they say, and that others can read it."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from defshade_cli import __version__
from defshade_cli.image import files, reading
from defshade_cli.image.metadata import frame_rate, provenance, time_code, world_to_camera, world_to_ndc
from defshade_cli.scene.camera import Camera
from defshade_cli.settings import OutputSettings
from films import HEIGHT, WIDTH, WINDOW, film, tilted_camera


@pytest.fixture
def exr(tmp_path: Path) -> Path:
    path = tmp_path / "all.exr"
    files.write(film(metadata={"owner": "A. Painter", "seconds": 1.5, "sizes": [1, 2]}), OutputSettings(), path)
    return path


def homogeneous(points: np.ndarray) -> np.ndarray:
    return np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1)


def points_on_pixels(camera: Camera, depth: float) -> tuple[np.ndarray, np.ndarray]:
    """((N, 2) places in the image, (0, 0) top left and (1, 1) bottom right; (N, 3) points there in world space)."""
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 4)))
    left, right, bottom, top = camera.window
    x, y = left + u * (right - left), top + v * (bottom - top)
    scale = depth if camera.projection == "perspective" else 1.0
    points = np.stack([scale * x, scale * y, np.full_like(x, -depth)], axis=-1)
    return np.stack([u, v], axis=-1), (homogeneous(points) @ camera.world_from_camera.T)[:, :3]


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_world_to_ndc_puts_the_corners_where_the_standard_does(projection: str) -> None:
    camera = tilted_camera(projection=projection)
    places, points = points_on_pixels(camera, depth=7.0)
    projected = homogeneous(points) @ world_to_ndc(camera)
    np.testing.assert_allclose(projected[:, :2] / projected[:, 3:], places, atol=1e-12)


def test_exr_camera_space_is_left_handed_and_looks_along_z() -> None:
    camera = tilted_camera()
    right, up, back = camera.world_from_camera[:3, :3].T
    point = camera.position + 2 * right + 3 * up - 5 * back
    np.testing.assert_allclose(homogeneous(point) @ world_to_camera(camera), [2, 3, 5, 1], atol=1e-12)
    assert np.linalg.det(world_to_camera(camera)) == pytest.approx(-1)


@pytest.mark.parametrize(
    ("rate", "rational"),
    [
        (24.0, (24, 1)),
        (23.976, (24000, 1001)),
        (24000 / 1001, (24000, 1001)),
        (29.97, (30000, 1001)),
        (59.94, (60000, 1001)),
        (12.5, (25, 2)),
        (1000.0, (1000, 1)),
    ],
)
def test_frame_rates_are_rational(rate: float, rational: tuple[int, int]) -> None:
    assert frame_rate(rate) == rational


@pytest.mark.parametrize(
    ("frame", "rate", "code"),
    [
        (0.0, 24.0, 0x00000000),
        (1001.0, 24.0, 0x00004117),  # 41 s 17 frames
        (86399.0 * 25 + 24, 25.0, 0x23595924),
        (86400.0 * 25, 25.0, None),
        (1.5, 24.0, None),
        (-1.0, 24.0, None),
        (None, 24.0, None),
        (30.0, 29.97, 0x00000100),
    ],
)
def test_time_codes_count_from_frame_zero(frame: float | None, rate: float, code: int | None) -> None:
    assert time_code(frame, rate) == code


def test_header_as_openexr_reads_it(exr: Path) -> None:
    header = pytest.importorskip("OpenEXR").File(str(exr)).header()
    camera = tilted_camera()
    assert header["chromaticities"] == pytest.approx((0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329))
    assert header["colorInteropID"] == "lin_rec709_scene"
    assert header["FramesPerSecond"] == Fraction(24, 1)
    assert "timeCode" in header
    assert header["owner"] == "A. Painter"
    assert header["Software"] == f"defshade {__version__}"
    assert "camera: /World/Cam" in header["comments"]
    assert header["pixelAspectRatio"] == pytest.approx(camera.aspect * HEIGHT / WIDTH, rel=1e-5)
    assert header["screenWindowWidth"] == pytest.approx(WINDOW[1] - WINDOW[0])
    assert header["screenWindowCenter"] == pytest.approx([-0.1, 0.025])
    np.testing.assert_allclose(header["worldToCamera"], world_to_camera(camera), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(header["worldToNDC"], world_to_ndc(camera), rtol=1e-6, atol=1e-6)
    depth = {"unit": "scene units", "space": "camera", "background": "inf", "antialiased": False}
    assert json.loads(header["defshade/layers"])["depth"] == depth
    assert header["defshade/samples"] == 16
    assert all(len(name) <= 31 for name in header), "longer names close the file to readers before OpenEXR 2"


def test_dates_are_local_time_with_its_offset(exr: Path) -> None:
    entries = {entry.name: entry.value for entry in oiio.ImageInput.open(str(exr)).spec().extra_attribs}
    date, clock = entries["DateTime"].split(" ")
    assert [len(part) for part in date.split(":") + clock.split(":")] == [4, 2, 2, 2, 2, 2]
    assert abs(entries["utcOffset"]) <= 14 * 3600


def test_provenance_comes_back_from_exr_with_its_types(exr: Path) -> None:
    header = reading.read_header(exr)
    assert (header["scene"], header["camera"], header["samples"]) == ("kitchen", "/World/Cam", 16)
    assert (header["frame"], header["seconds"], header["sizes"]) == (12.0, 1.5, "[1, 2]")


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".tga"])
def test_provenance_comes_back_from_pictures_as_text(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    files.write(film("beauty"), OutputSettings(), path)
    header = reading.read_header(path)
    assert (header["scene"], header["stage hash"], header["samples"]) == ("kitchen", "0123abcd", "16")


def test_the_default_time_has_no_frame() -> None:
    assert "frame" not in provenance(replace(film("beauty"), frame=None))


def test_a_file_of_data_alone_claims_no_colour_space(tmp_path: Path) -> None:
    files.write(film("normal"), OutputSettings(), tmp_path / "n.exr")
    spec = oiio.ImageInput.open(str(tmp_path / "n.exr")).spec()
    assert spec.get_string_attribute("colorInteropID") == "data"
    assert spec.getattribute("chromaticities") is None


def test_pictures_of_the_srgb_display_say_so(tmp_path: Path) -> None:
    """Which is what their encoders write unasked."""
    beauty = film().layers["beauty"]
    shown = {}
    for view in (None, "Un-tone-mapped"):
        path = tmp_path / f"{view}.png"
        files.write(replace(film(), layers={"beauty": beauty}), OutputSettings(view=view), path)
        shown[view] = path.read_bytes()
    assert all(b"sRGB\x03" in content and b"gAMA\x00\x00\xb1\x8f" in content for content in shown.values())


def test_the_space_of_colours_is_in_the_header(exr: Path) -> None:
    header = oiio.ImageInput.open(str(exr)).spec()
    assert header.getattribute("colorInteropID") == header.getattribute("oiio:ColorSpace") == "lin_rec709_scene"
