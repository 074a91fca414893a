"""Images in tiles are the images that are drawn at once."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from defshade_cli import render, resources
from defshade_cli.errors import GpuError, GpuMemoryError
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.rendering import tiles
from defshade_cli.scene.window import DataWindow

LAYERS = ("beauty", "depth", "primId", "position")


@pytest.mark.parametrize("window", [DataWindow(0, 0, 10, 7), DataWindow(-3, 5, 8, 8), DataWindow(0, 0, 1, 30)])
def test_tiles_cover_every_pixel_once(window: DataWindow) -> None:
    hit = np.zeros((60, 60), int)
    for tile in window.tiles(4):
        assert max(tile.size) <= 4
        hit[tile.y + 10 : tile.y + 10 + tile.height, tile.x + 10 : tile.x + 10 + tile.width] += 1
    assert hit.sum() == window.width * window.height
    assert hit.max() == 1


@pytest.mark.parametrize("options", [{}, {"crop": (-4, 3, 40, 20)}], ids=["whole", "crop"])
def test_tiles_join_to_the_whole(options: dict[str, Any], scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rasterizers snap vertices to 1/256 pixel: an edge may fall otherwise."""
    settings = {"size": (48, 27), "layers": LAYERS, "shadows": False} | options
    whole = render(scenes / "opacity.usda", **settings)
    monkeypatch.setattr(tiles, "LARGEST", 16)
    parts = render(scenes / "opacity.usda", **settings)
    assert (parts.size, parts.origin, parts.display_size) == (whole.size, whole.origin, whole.display_size)
    assert parts.manifests == whole.manifests
    for name in LAYERS:
        close = np.isclose(parts.layers[name], whole.layers[name], rtol=1e-3, atol=1e-3).all(axis=-1)
        assert close.mean() > 0.995, name


def test_samples_in_tiles_have_the_same_mean(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Points on lights are drawn towards what a tile sees: single pixels differ by the noise of three samples."""
    settings: dict[str, Any] = {"size": (48, 27), "shadows": False, "samples": 3}
    whole = render(scenes / "opacity.usda", **settings)
    monkeypatch.setattr(tiles, "LARGEST", 16)
    parts = render(scenes / "opacity.usda", **settings)
    assert parts.metadata["samples"] == whole.metadata["samples"]
    assert np.abs(parts.layers["beauty"] - whole.layers["beauty"]).mean() < 1e-3
    assert parts.layers["beauty"].mean() == pytest.approx(whole.layers["beauty"].mean(), rel=1e-3)


def test_where_memory_ends_tiles_become_smaller(
    scenes: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    draw = Pipeline.render

    def narrow(self, scene, plan, *rest):  # type: ignore[no-untyped-def]
        if max(plan.size) > 90:
            raise GpuMemoryError("no memory for a target")
        return draw(self, scene, plan, *rest)

    monkeypatch.setattr(Pipeline, "render", narrow)
    film = render(scenes / "gprims.usda", size=(160, 90))
    assert film.size == (160, 90)
    assert "tiles of 80 pixels" in caplog.text


def test_memory_that_never_suffices_is_an_error(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object) -> None:
        raise GpuMemoryError("no memory for a target")

    monkeypatch.setattr(Pipeline, "render", failing)
    with pytest.raises(GpuMemoryError):
        render(scenes / "gprims.usda", size=(160, 90))


@pytest.mark.parametrize("size", [(1, 1), (1, 1000), (5000, 3)])
def test_narrow_images_are_drawn(size: tuple[int, int], scenes: Path) -> None:
    film = render(scenes / "gprims.usda", size=size)
    assert film.size == size
    assert np.isfinite(film.layers["beauty"]).all()


def test_what_the_driver_fails_at_is_raised(gpu: Gpu) -> None:
    """GL tells nobody: without the look at its error a wrong image would pass for a right one."""
    with pytest.raises(GpuError, match="GL_INVALID_ENUM"), gpu.watched():
        gpu._entry_point("glEnable", ctypes.c_uint)(0xFFFF)
    with gpu.watched():
        pass


def test_memory_that_ends_amid_a_frame_is_told_as_such(gpu: Gpu) -> None:
    """An address space that is full, as a device's memory may be: in a process of its own, which keeps the limit."""
    script = """
import resource
from defshade_cli import render, resources
from defshade_cli.errors import GpuError, GpuMemoryError
from defshade_cli.gpu.context import Gpu
render("SCENES/gprims.usda", size=(32, 18))
held = int(open("/proc/self/status").read().partition("VmData:")[2].split()[0]) * 1024
resource.setrlimit(resource.RLIMIT_DATA, (held + (8 << 20), -1))
try:
    render("SCENES/gprims.usda", size=(2000, 2000))
except GpuMemoryError as error:
    raise SystemExit(error.exit_code)
"""
    command = [sys.executable, "-c", script.replace("SCENES", str(resources.SCENES))]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120)
    if "LLVM ERROR" in result.stderr:
        pytest.skip("memory ended in llvmpipe's compiler first, which ends the process")
    assert result.returncode == GpuMemoryError.exit_code, result.stderr[-2000:]
    assert "the image is drawn in tiles of" in result.stderr
