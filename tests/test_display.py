"""The display transform on the graphics device: equal to the CPU's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from defshade_cli.gpu.context import Gpu
from defshade_cli.image.colour import display_transform, displays
from defshade_cli.image.display_shader import display_shader
from defshade_cli.image.ocio import find_render_space
from defshade_cli.passes.display import DisplayPass
from defshade_cli.rendering import pictures, run
from defshade_cli.settings import OutputSettings, RenderJob, RenderSettings

STEP = 1 / 1023
"""Of ten bits."""

VIEWS = [("sRGB - Display", view) for view in displays()["sRGB - Display"]]


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


def test_rows_that_stay_are_not_shown_again(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """Frame after frame: what is shown is what a new pass shows, of the rows that changed and of no others."""
    shader = display_shader(display_transform())
    assert shader is not None
    kept, drawn, draw = DisplayPass(gpu, shader), [], DisplayPass._draw
    first = colours(alpha=True)
    second, smaller = first.copy(), first[:20].copy()
    second[7:9, 3] *= 0.5
    for frame in (first, second, second, smaller, smaller):
        fresh = DisplayPass(gpu, shader).show(frame, straight=True, in_bytes=True)
        with monkeypatch.context() as patch:
            patch.setattr(DisplayPass, "_draw", lambda self, part, *a: drawn.append(len(part)) or draw(self, part, *a))
            np.testing.assert_array_equal(kept.show(frame, straight=True, in_bytes=True), fresh)
    assert drawn == [48, 2, 20]


def test_large_pictures_are_shown_by_the_device(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same picture either way, in formats with alpha and without; half a step of 8 bits may round either way."""
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
