"""The display transform on the graphics device: equal to the CPU's."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from defshade_cli.gpu.context import Gpu
from defshade_cli.image.colour import display_transform
from defshade_cli.image.display_shader import DisplayShader, display_shader
from defshade_cli.image.display_table import bake, kept_table
from defshade_cli.image.ocio import find_render_space, read_displays
from defshade_cli.passes.display import DisplayPass
from defshade_cli.rendering import pictures, run
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

STEP = 1 / 1023
"""Of ten bits."""

CONFIG = """\
ocio_profile_version: 2
roles: {scene_linear: lin_srgb, default: lin_srgb}
file_rules: [!<Rule> {name: Default, colorspace: default}]
displays:
  Wall: [!<View> {name: Plain, colorspace: lin_srgb}]
colorspaces: [!<ColorSpace> {name: lin_srgb, aliases: [lin_rec709_scene]}]
"""

VIEWS = [("sRGB - Display", view) for view in read_displays().views["sRGB - Display"]]


def colours(alpha: bool) -> np.ndarray:
    """Premultiplied, over fourteen stops, with black, negative and enormous values among them."""
    rng = np.random.default_rng(3)
    pixels = np.exp2(rng.uniform(-10, 4, (48, 64, 4))).astype(np.float32)
    pixels[..., 3] = rng.random((48, 64)) if alpha else 1.0
    pixels[..., :3] *= pixels[..., 3:]
    pixels[0, :3, :3] = [[0, 0, 0], [-0.5, 0.2, 0.1], [1e6, 3e4, np.inf]]
    pixels[1, 0] = 0
    return pixels


@pytest.mark.parametrize(("display", "view"), [*VIEWS, ("Rec.2100-PQ - Display", None), ("P3-D65 - Display", None)])
@pytest.mark.parametrize("straight", [True, False])
def test_the_device_shows_what_the_cpu_does(gpu: Gpu, display: str, view: str | None, straight: bool) -> None:
    transform = display_transform(display, view)
    shader = display_shader(transform)
    assert shader is not None
    pixels = colours(alpha=straight) if straight else colours(alpha=False)[..., :3]
    shown = DisplayPass(gpu, shader).show(pixels, straight=straight)
    np.testing.assert_allclose(shown, transform.apply(pixels, straight=straight), atol=STEP)


def test_looks_and_render_spaces_reach_the_device(gpu: Gpu) -> None:
    look = "ACES 1.3 Reference Gamut Compression"
    transform = display_transform(look=look, space=find_render_space("ACEScg"))
    shader = display_shader(transform)
    assert shader is not None
    pixels = colours(alpha=False)[1:, :, :3]
    np.testing.assert_allclose(
        DisplayPass(gpu, shader).show(pixels, straight=False), transform.apply(pixels), atol=STEP
    )


def test_what_stays_is_not_shown_again(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """Frame after frame: what is shown is what a new pass shows, of the pieces that changed and of no others."""
    shader = display_shader(display_transform())
    assert shader is not None
    kept, drawn, draw = DisplayPass(gpu, shader), [], DisplayPass._draw
    first = np.hstack([colours(alpha=True)] * 2)
    second, smaller = first.copy(), first[:20].copy()
    second[7:9, 3] *= 0.5
    for frame in (first, second, second, smaller, smaller):
        fresh = DisplayPass(gpu, shader).show(frame, straight=True, in_bytes=True)
        with monkeypatch.context() as patch:
            patch.setattr(DisplayPass, "_draw", lambda self, part, *a: drawn.append(len(part)) or draw(self, part, *a))
            np.testing.assert_array_equal(kept.show(frame, straight=True, in_bytes=True), fresh)
    assert drawn == [48, 1, 20]


def test_a_table_is_within_half_a_step_where_it_is_used(gpu: Gpu) -> None:
    """Colours of fourteen stops, saturated and not: half a step, and half that rounding takes. The rest is exact."""
    shader = display_shader(display_transform())
    assert shader is not None
    exact, rng = DisplayPass(gpu, shader), np.random.default_rng(5)
    table = bake(lambda pixels: exact.show(pixels, straight=False))
    brightness, saturation = np.exp2(rng.uniform(-10, 4, (400, 500, 1))), rng.choice([0.2, 1.0, 3.0], (400, 1, 1))
    pixels = (brightness * rng.random((400, 500, 3)) ** saturation).astype(np.float32)
    pixels[0], pixels[1] = -pixels[0], 300.0 * (1.0 + pixels[1])
    shown = DisplayPass(gpu, shader, table).show(pixels, straight=False, in_bytes=True)
    np.testing.assert_allclose(shown / 255.0, exact.show(pixels, straight=False), atol=1.0 / 255.0)
    np.testing.assert_array_equal(shown[:2], exact.show(pixels[:2], straight=False, in_bytes=True))
    assert (table[:-1, :-1, :-1, 3] > 0.0).mean() < 0.06


def test_a_table_is_baked_once_where_it_can_be_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shader, baked = DisplayShader("vec4 display(vec4 color) { return color; }", ()), []
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for _ in range(2):
        table = kept_table(shader, lambda pixels: baked.append(len(pixels)) or np.clip(pixels, 0.0, 1.0))
    assert len(baked) == 1 and table.shape == (65, 65, 65, 4)
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert np.array_equal(kept_table(shader, lambda pixels: pixels), bake(lambda pixels: pixels))


def test_large_pictures_are_shown_by_the_device(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same picture either way, in formats with alpha and without; half a step of 8 bits may round either way."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (tmp_path / "ball.usda").write_text('#usda 1.0\ndef Sphere "ball" {}\ndef DistantLight "sun" {}\n')
    shown = {}
    for least in (0, 10**9):
        monkeypatch.setattr(pictures, "_WORTHWHILE", least)
        files = tuple(str(tmp_path / f"{least}{suffix}") for suffix in (".png", ".bmp", ".exr"))
        job = RenderJob(
            tmp_path / "ball.usda", (1.0,), settings=RenderSettings(size=(64, 36)), output=OutputSettings(files)
        )
        (result,) = run(job)
        film = result.images[0].film
        assert film is not None and set(film.shown) == (set() if least else {("beauty", True), ("beauty", False)})
        shown[least] = [oiio.ImageBuf(file).get_pixels(oiio.FLOAT) for file in files[:2]]
    for device, cpu in zip(*shown.values(), strict=True):
        np.testing.assert_allclose(device, cpu, atol=1.01 / 255)


def test_what_opencolorio_answered_is_kept_but_of_configs_that_may_change(tmp_path: Path) -> None:
    """A second picture loads neither the library nor a config, and a config in a file is asked each time."""
    code = (
        "import sys; from defshade_cli.image.colour import display_transform as transform\n"
        "from defshade_cli.image.display_shader import display_shader\n"
        "told = transform(); shader = display_shader(told)\n"
        "print(told.encoding, hash((shader.source, *(t.values.tobytes() for t in shader.tables))), file=sys.stderr)\n"
        "print('PyOpenColorIO' in sys.modules)"
    )
    told = []
    (tmp_path / "own.ocio").write_text(CONFIG)
    for config in ("", "", "ocio://default", str(tmp_path / "own.ocio"), str(tmp_path / "own.ocio")):
        environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path), "OCIO": config, "PYTHONHASHSEED": "0"}
        python = [sys.executable, "-c", code]
        told.append(subprocess.run(python, env=environment, capture_output=True, text=True, check=True))
    assert [each.stdout.strip() for each in told] == ["True", "False", "False", "True", "True"]
    assert told[0].stderr == told[1].stderr == told[2].stderr
