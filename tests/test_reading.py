"""Image files → layers, whoever wrote them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from defshade_cli.errors import OutputError
from defshade_cli.image import files, reading
from defshade_cli.settings import OutputSettings
from films import film, with_beauty

DEFAULT = OutputSettings()


def test_unreadable_files(tmp_path: Path) -> None:
    (tmp_path / "broken.exr").write_bytes(b"not an image")
    for name in ("missing.exr", "broken.exr"):
        with pytest.raises(OutputError, match=name):
            reading.read(tmp_path / name)


def test_a_truncated_exr_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    files.write(film("beauty", size=(256, 256)), DEFAULT, path)
    path.write_bytes(path.read_bytes()[:-4000])
    with pytest.raises(OutputError, match="cannot be read"):
        reading.read(path)


def test_what_was_rewritten_is_read_anew(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    for value in (0.25, 0.5):
        files.write(with_beauty(np.full((4, 4, 4), value)), DEFAULT, path)
        assert reading.read(path)["beauty"].max() == value


def write_foreign(path: Path, *parts: tuple[str, tuple[str, ...]], window: tuple[int, int] = (0, 0)) -> None:
    """An EXR as others write it: parts of (name, channels), channel c holding c + 1, on a 6x4 canvas."""
    specs = []
    for name, channels in parts:
        spec = oiio.ImageSpec(3, 2, len(channels), "float")
        spec.channelnames = channels
        spec.x, spec.y = window
        spec.full_width, spec.full_height = 6, 4
        spec.attribute("oiio:subimagename", name)
        specs.append(spec)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), tuple(specs)), output.geterror()
    for index, spec in enumerate(specs):
        if index:
            assert output.open(str(path), spec, "AppendSubimage")
        pixels = np.ones((2, 3, spec.nchannels), np.float32) * np.arange(1, spec.nchannels + 1, dtype=np.float32)
        assert output.write_image(pixels), output.geterror()
    output.close()


def test_parts_of_other_renderers_become_layers(tmp_path: Path) -> None:
    path = tmp_path / "parts.exr"
    write_foreign(path, ("beauty", ("R", "G", "B", "A")), ("depth", ("Z",)), ("N", ("N.X", "N.Y", "N.Z")))
    layers = reading.read(path)
    assert {name: values.shape[2] for name, values in layers.items()} == {"beauty": 4, "depth": 1, "N": 3}


def test_nested_and_bare_channels_of_other_renderers(tmp_path: Path) -> None:
    path = tmp_path / "bare.exr"
    write_foreign(path, ("", ("R", "G", "B", "Z", "ViewLayer.Combined.R")))
    layers = reading.read(path)
    assert {name: values.shape[2] for name, values in layers.items()} == {
        "beauty": 3,
        "depth": 1,
        "ViewLayer.Combined": 1,
    }


@pytest.mark.parametrize("window", [(2, 1), (-1, -1), (4, 3)])
def test_cropped_images_are_filled_up(window: tuple[int, int], tmp_path: Path) -> None:
    path = tmp_path / "crop.exr"
    write_foreign(path, ("", ("R", "G", "B")), window=window)
    beauty = reading.read(path)["beauty"]
    expected = np.zeros((4, 6, 3))
    for y in range(2):
        for x in range(3):
            row, column = window[1] + y, window[0] + x
            if 0 <= row < 4 and 0 <= column < 6:
                expected[row, column] = 1, 2, 3
    np.testing.assert_array_equal(beauty, expected)
