"""Scene-linear → display."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from defshade_cli.errors import UsageError
from defshade_cli.image.colour import display_transform, picture
from defshade_cli.image.layers import LAYERS
from defshade_cli.image.ocio import read_displays
from films import film, layer_values

SRGB, ACES, PLAIN = "sRGB - Display", "ACES 2.0 - SDR 100 nits (Rec.709)", "Un-tone-mapped"

CONFIG = """\
ocio_profile_version: 2
roles: {scene_linear: lin_srgb, default: lin_srgb}
file_rules: [!<Rule> {name: Default, colorspace: default}]
displays:
  Wall: [!<View> {name: Root, colorspace: root}]
colorspaces:
  - !<ColorSpace> {name: lin_srgb, aliases: [lin_rec709_scene]}
  - !<ColorSpace>
    name: root
    from_scene_reference: !<ExponentTransform> {value: [0.5, 0.5, 0.5, 1]}
"""

pytestmark = pytest.mark.skipif("OCIO" in os.environ, reason="these tests speak of the built-in config")


def to_display(pixels: np.ndarray, *, straight: bool = False, **choice: str) -> np.ndarray:
    return display_transform(**choice).apply(pixels, straight=straight)


def grey(value: float, alpha: float = 1.0) -> np.ndarray:
    return np.array([[[value, value, value, alpha]]], np.float32)


@pytest.mark.parametrize("view", [ACES, PLAIN])
def test_the_transform_is_openimageios(view: str) -> None:
    """ociodisplay on its own, over colours up to 16 and alpha from 0: equal to a step of 10 bits."""
    pixels = np.random.default_rng(0).random((64, 64, 4), np.float32)
    pixels[..., :3] *= 16 * pixels[..., 3:]
    pixels[0, 0] = 0
    expected = oiio.ImageBufAlgo.ociodisplay(oiio.ImageBuf(pixels), SRGB, view, "lin_rec709_scene")
    np.testing.assert_allclose(to_display(pixels, view=view), expected.get_pixels("float").clip(0, 1), atol=1 / 1023)


def test_greys_follow_srgb() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # colour-science tells of the optional packages it misses
        colour = pytest.importorskip("colour")
    values = np.linspace(0, 1, 256, dtype=np.float32)
    shown = to_display(np.repeat(values[None, :, None], 3, axis=2), view=PLAIN)
    encoded = colour.cctf_encoding(values, function="sRGB")
    np.testing.assert_allclose(shown[0], np.repeat(encoded[:, None], 3, axis=1), atol=0.1 / 255)


def test_the_default_is_tone_mapped() -> None:
    """ACES 2.0 puts 18 % grey at 10 nits of 100: 0.1 through the inverse sRGB curve is 0.349."""
    assert (display_transform().display, display_transform().view) == (SRGB, ACES)
    np.testing.assert_allclose(to_display(grey(0.18))[0, 0], [0.349, 0.349, 0.349, 1], atol=0.002)
    assert to_display(grey(1000.0))[0, 0, 0] == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("view", [ACES, PLAIN])
@pytest.mark.parametrize("alpha", [0.1, 0.5, 1.0])
def test_coverage_does_not_change_the_colour(view: str, alpha: float) -> None:
    opaque = to_display(grey(0.4), view=view)[0, 0, 0]
    covered = grey(0.4 * alpha, alpha)
    assert to_display(covered, view=view, straight=True)[0, 0] == pytest.approx([opaque] * 3 + [alpha], abs=1e-4)
    assert to_display(covered, view=view)[0, 0] == pytest.approx([opaque * alpha] * 3 + [alpha], abs=1e-4)


def test_three_channels_are_opaque() -> None:
    four = to_display(grey(0.4))
    np.testing.assert_allclose(to_display(grey(0.4)[..., :3]), four[..., :3], atol=1e-6)


@pytest.mark.parametrize("view", [ACES, PLAIN])
@pytest.mark.parametrize("odd", [np.nan, np.inf, -np.inf, 1e30, -5.0])
def test_odd_values_stay_in_range_and_alone(odd: float, view: str) -> None:
    pixels = np.full((3, 5, 4), (0.2, 0.3, 0.4, 1.0), np.float32)
    clean = to_display(pixels, view=view)
    pixels[1, 2, 0] = odd
    shown = to_display(pixels, view=view)
    assert shown.min() >= 0 and shown.max() <= 1
    others = np.ones((3, 5), bool)
    others[1, 2] = False
    np.testing.assert_allclose(shown[others], clean[others], atol=1e-6)
    assert shown[1, 2, 3] == 1


def test_the_source_is_not_written_to() -> None:
    pixels = layer_values("beauty")
    before = pixels.copy()
    to_display(pixels)
    np.testing.assert_array_equal(pixels, before)


def test_pictures_of_ids_motion_and_mattes() -> None:
    """Equal ids have equal colours, the background none; motion is grey where there is none."""
    ids = np.array([[[3], [3], [4], [-1]]], np.float32)
    shown = picture(LAYERS["primId"], ids, display_transform(), alpha=True)[0]
    assert (shown[0] == shown[1]).all() and (shown[0] != shown[2]).any() and not shown[3].any()
    motion = np.array([[[0, 0], [4, -4], [-2, 0]]], np.float32)
    shown = picture(LAYERS["motionForward"], motion, display_transform(), alpha=True)[0]
    np.testing.assert_allclose(shown, [[0.5, 0.5, 0.5], [1.0, 0.0, 0.5], [0.25, 0.5, 0.5]])
    matte = np.zeros((1, 1, 12), np.float32)
    assert not picture(LAYERS["cryptoObject"], matte, display_transform(), alpha=True).any()


def test_displays_and_views_are_listed() -> None:
    assert {ACES, PLAIN, "Raw"} <= set(read_displays().views[SRGB])
    assert display_transform("Display P3 - Display").view in read_displays().views["Display P3 - Display"]
    assert display_transform().encoding == SRGB


def test_what_the_config_lacks_is_refused_with_what_it_has() -> None:
    with pytest.raises(UsageError, match=r"no display 'TV'.*sRGB - Display"):
        to_display(grey(0.5), display="TV")
    with pytest.raises(UsageError, match=r"no view 'Film'.*Un-tone-mapped"):
        to_display(grey(0.5), view="Film")


def in_a_process_with(config: Path) -> subprocess.CompletedProcess[str]:
    code = (
        "import numpy as np; from defshade_cli.image.ocio import read_displays\n"
        "from defshade_cli.image.colour import display_transform\n"
        "shown = display_transform().apply(np.full((1, 1, 3), 0.25, np.float32))\n"
        "print(read_displays().views, shown.round(3).ravel().tolist())"
    )
    environment = os.environ | {"OCIO": str(config)}
    return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)


def test_the_environments_config_holds(tmp_path: Path) -> None:
    (tmp_path / "studio.ocio").write_text(CONFIG)
    assert in_a_process_with(tmp_path / "studio.ocio").stdout == "{'Wall': {'Root': 'root'}} [0.5, 0.5, 0.5]\n"


def test_a_config_that_is_missing_is_told(tmp_path: Path) -> None:
    told = in_a_process_with(tmp_path / "none.ocio").stderr.splitlines()[-1]
    assert told.startswith("defshade_cli.errors.UsageError: the OCIO config cannot be used") and "none.ocio" in told


def test_pictures_are_in_range_whatever_the_layer() -> None:
    for name, values in film().layers.items():
        shown = picture(LAYERS[name], values, display_transform(), alpha=True)
        assert shown.shape[:2] == values.shape[:2] and shown.shape[2] in (1, 3, 4)
        assert np.isfinite(shown).all() and shown.min() >= 0 and shown.max() <= 1


def test_lengths_are_stretched_from_white_at_the_nearest() -> None:
    depth = np.array([[[2.0], [4.0], [6.0], [np.inf]]], np.float32)
    np.testing.assert_allclose(picture(LAYERS["depth"], depth, display_transform(), alpha=True).ravel(), [1, 0.5, 0, 0])
    flat, empty = np.full((1, 2, 1), 3, np.float32), np.full((1, 2, 1), np.inf, np.float32)
    assert picture(LAYERS["depth"], flat, display_transform(), alpha=True).ravel().tolist() == [1, 1]
    assert picture(LAYERS["depth"], empty, display_transform(), alpha=True).ravel().tolist() == [0, 0]
