"""Film → files, and back."""

from __future__ import annotations

import logging
import os
import resource
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from defshade_cli.errors import OutputError, UsageError
from defshade_cli.image import files, reading
from defshade_cli.image.appearing import write_text
from defshade_cli.image.encoders import SUFFIXES, check_format
from defshade_cli.image.film import Film
from defshade_cli.image.layers import LAYERS
from defshade_cli.settings import COMPRESSIONS, OutputSettings
from films import film, with_beauty

COLOURS = [name for name, layer in LAYERS.items() if layer.is_color]
DATA = [name for name in LAYERS if name not in COLOURS]
PICTURES = [suffix for suffix in SUFFIXES if suffix != ".exr"]
DEFAULT = OutputSettings()


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """Writes beyond `size` bytes fail, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("compression", [name for name in COMPRESSIONS if name != "dwaa"])
def test_exr_keeps_data_to_the_bit_and_colour_to_half(compression: str, tmp_path: Path) -> None:
    frame = film()
    assert files.write(frame, OutputSettings(compression=compression), tmp_path / "a.exr") == (tmp_path / "a.exr",)
    layers = reading.read(tmp_path / "a.exr")
    assert set(layers) == set(LAYERS)
    for name in COLOURS:
        np.testing.assert_array_equal(layers[name], frame.layers[name].astype(np.float16).astype(np.float32))
    for name in DATA:
        np.testing.assert_array_equal(layers[name], frame.layers[name])


def test_dwaa_loses_colour_only(tmp_path: Path) -> None:
    """At DWA's default level of 45 noise of 0..4 moves by less than 0.1; depth.Z is no channel that it blurs."""
    frame = film("beauty", "depth")
    files.write(frame, OutputSettings(compression="dwaa"), tmp_path / "a.exr")
    layers = reading.read(tmp_path / "a.exr")
    np.testing.assert_array_equal(layers["depth"], frame.layers["depth"])
    assert 0 < np.abs(layers["beauty"] - frame.layers["beauty"]).max() < 0.1


@pytest.mark.parametrize("name", DATA)
def test_dwaa_gives_way_to_data_that_it_would_blur(name: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    frame = film("beauty", name)
    files.write(frame, OutputSettings(compression="dwaa"), tmp_path / "a.exr")
    np.testing.assert_array_equal(reading.read(tmp_path / "a.exr")[name], frame.layers[name])
    assert ("zip" in caplog.text) == bool({"R", "G", "B", "Y"} & LAYERS[name].suffixes)


def test_full_float_keeps_everything_to_the_bit(tmp_path: Path) -> None:
    frame = film()
    files.write(frame, OutputSettings(full_float=True), tmp_path / "a.exr")
    for name, values in reading.read(tmp_path / "a.exr").items():
        np.testing.assert_array_equal(values, frame.layers[name])


@pytest.mark.parametrize("height", [1, 127, 128, 129, 300])
def test_every_row_is_written(height: int, tmp_path: Path) -> None:
    frame = film("beauty", "depth", size=(5, height))
    files.write(frame, OutputSettings(full_float=True), tmp_path / "a.exr")
    for name, values in reading.read(tmp_path / "a.exr").items():
        np.testing.assert_array_equal(values, frame.layers[name])


def test_exr_channels_and_their_types(tmp_path: Path) -> None:
    frame = film("normal", "beauty", "depth")
    files.write(frame, DEFAULT, tmp_path / "a.exr")
    spec = oiio.ImageInput.open(str(tmp_path / "a.exr")).spec()
    types = dict(zip(spec.channelnames, map(str, spec.channelformats), strict=True))
    halves, floats = ("R", "G", "B", "A"), ("depth.Z", "normal.X", "normal.Y", "normal.Z")
    assert types == dict.fromkeys(halves, "half") | dict.fromkeys(floats, "float")
    assert spec.get_string_attribute("compression") == "zip"


def test_the_order_of_a_request_does_not_change_the_file(tmp_path: Path) -> None:
    frame = film("beauty", "depth", "normal")
    turned = replace(frame, layers=dict(reversed(frame.layers.items())))
    one, other = tmp_path / "1.exr", tmp_path / "2.exr"
    for path, each in ((one, frame), (other, turned)):
        files.write(each, DEFAULT, path)
    specs = [oiio.ImageInput.open(str(path)).spec() for path in (one, other)]
    assert specs[0].channelnames == specs[1].channelnames


def test_names_of_files() -> None:
    def names(*layers: str, path: str, split: bool = False) -> list[str]:
        return [p.as_posix() for p in files.targets(layers, OutputSettings(split_layers=split), Path(path))]

    assert names("depth", "beauty", path="o/a.0001.exr") == ["o/a.0001.exr"]
    assert names("depth", "beauty", path="a.1.exr", split=True) == ["a.1.beauty.exr", "a.1.depth.exr"]
    assert names("beauty", path="a.exr", split=True) == ["a.beauty.exr"]
    assert names("depth", "beauty", path="a.png") == ["a.png", "a.depth.png"]
    assert names("depth", path="a.PNG") == ["a.PNG"]
    assert names("depth", "normal", path="a.png") == ["a.depth.png", "a.normal.png"]


def test_split_layers_read_back_under_their_names(tmp_path: Path) -> None:
    frame = film("beauty", "depth", "normal")
    paths = files.write(frame, OutputSettings(split_layers=True), tmp_path / "a.exr")
    assert [path.name for path in paths] == ["a.beauty.exr", "a.depth.exr", "a.normal.exr"]
    assert [list(reading.read(path)) for path in paths] == [["beauty"], ["depth"], ["normal"]]
    np.testing.assert_array_equal(reading.read(paths[1])["depth"], frame.layers["depth"])


@pytest.mark.parametrize("suffix", PICTURES)
def test_every_picture_format_reads_back(suffix: str, tmp_path: Path) -> None:
    """An opaque ramp, turned over in no way, to half the format's step; JPEG's DCT and YCbCr cost a few steps."""
    values = np.zeros((16, 24, 4), np.float32)
    values[..., 0], values[..., 1] = np.linspace(0, 1, 24), np.linspace(0, 1, 16)[:, None]
    values[..., 3] = 1
    (path,) = files.write(with_beauty(values), OutputSettings(view="Raw"), tmp_path / f"a{suffix}")
    beauty = reading.read(path)["beauty"]
    tolerance = {".tif": 0.5 / 65535, ".tiff": 0.5 / 65535, ".jpg": 5 / 255, ".jpeg": 5 / 255}.get(suffix, 0.5 / 255)
    np.testing.assert_allclose(beauty[..., :3], values[..., :3], atol=tolerance + 1e-6)


@pytest.mark.parametrize("suffix", [".png", ".tif", ".webp", ".tga"])
def test_alpha_is_straight_in_pictures(suffix: str, tmp_path: Path) -> None:
    values = np.full((8, 8, 4), (0.2, 0.1, 0.05, 0.25), np.float32)
    (path,) = files.write(with_beauty(values), OutputSettings(view="Raw"), tmp_path / f"a{suffix}")
    np.testing.assert_allclose(reading.read(path)["beauty"][0, 0], [0.8, 0.4, 0.2, 0.25], atol=0.5 / 255 + 1e-6)


@pytest.mark.parametrize("suffix", [".jpg", ".bmp", ".ppm"])
def test_formats_without_alpha_show_the_picture_on_black(suffix: str, tmp_path: Path) -> None:
    values = np.full((8, 8, 4), (0.2, 0.1, 0.05, 0.25), np.float32)
    (path,) = files.write(with_beauty(values), OutputSettings(view="Raw"), tmp_path / f"a{suffix}")
    np.testing.assert_allclose(reading.read(path)["beauty"][0, 0], [0.2, 0.1, 0.05], atol=2 / 255)


def test_pictures_of_data(tmp_path: Path) -> None:
    frame = film("beauty", "depth", "normal", "roughness")
    _, depth, normal, roughness = (reading.read(p) for p in files.write(frame, DEFAULT, tmp_path / "a.png"))
    np.testing.assert_allclose(normal["beauty"], 0.5 * frame.layers["normal"] + 0.5, atol=0.5 / 255 + 1e-6)
    np.testing.assert_allclose(roughness["beauty"], frame.layers["roughness"], atol=0.5 / 255 + 1e-6)
    nearest = np.argmin(frame.layers["depth"])
    assert depth["beauty"].ravel()[nearest] == 1
    assert depth["beauty"][np.isinf(frame.layers["depth"])].max() == 0


def test_writing_leaves_the_film_as_it_was(tmp_path: Path) -> None:
    frame = with_beauty(np.full((4, 4, 4), (1e6, -3.0, np.nan, 0.5)))
    before = frame.layers["beauty"].copy()
    for suffix in (".exr", ".png", ".jpg"):
        files.write(frame, DEFAULT, tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(frame.layers["beauty"], before)


@pytest.mark.parametrize("suffix", [".exr", ".png"])
@pytest.mark.parametrize("name", ["beauty", "normal", "depth"])
def test_read_back_views_are_written_as_they_look(name: str, suffix: str, tmp_path: Path) -> None:
    """A GPU's rows come bottom up, so that layers may be views with negative strides, or planar."""
    values = film(name).layers[name]
    upside_down = values[::-1].copy()[::-1]
    planar = np.moveaxis(np.moveaxis(values, -1, 0).copy(), 0, -1)
    frames = [replace(film(name), layers={name: each}) for each in (values, upside_down, planar)]
    paths = [tmp_path / f"{index}{suffix}" for index in range(3)]
    for path, frame in zip(paths, frames, strict=True):
        files.write(frame, DEFAULT, path)
    plain, *others = (next(iter(reading.read(path).values())) for path in paths)
    for other in others:
        np.testing.assert_array_equal(other, plain)


def test_light_beyond_half_is_clamped_and_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    values = np.ones((4, 4, 4))
    values[0, 0, :3] = 1e6, -1e6, np.inf
    with caplog.at_level(logging.WARNING, "defshade"):
        files.write(with_beauty(values), DEFAULT, tmp_path / "a.exr")
    assert "beauty: 3 values beyond half's 65504 are clamped" in caplog.text
    np.testing.assert_array_equal(reading.read(tmp_path / "a.exr")["beauty"][0, 0], [65504, -65504, 65504, 1])


def test_full_float_clamps_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    files.write(with_beauty(np.full((4, 4, 4), 1e6)), OutputSettings(full_float=True), tmp_path / "a.exr")
    assert reading.read(tmp_path / "a.exr")["beauty"].max() == 1e6 and not caplog.text


@pytest.mark.parametrize("suffix", [".exr", ".png"])
def test_nan_is_told(suffix: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    values = np.ones((4, 4, 4))
    values[1, 2:, 0] = np.nan
    with caplog.at_level(logging.WARNING, "defshade"):
        files.write(with_beauty(values), OutputSettings(view="Raw"), tmp_path / f"a{suffix}")
    assert "beauty: 2 values are NaN" in caplog.text
    beauty = reading.read(tmp_path / f"a{suffix}")["beauty"]
    assert np.isnan(beauty[1, 2:, 0]).all() if suffix == ".exr" else (beauty[1, 2:, 0] == 0).all()
    assert (beauty[..., 3] == 1).all()


def test_infinite_depth_is_no_fault(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    files.write(film("depth"), DEFAULT, tmp_path / "a.exr")
    assert not caplog.text


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_full_disk_leaves_nothing_and_spares_what_stood_there(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"the frame before")
    frame = film("beauty", size=(256, 128))
    with largest_file(4096), pytest.raises(OutputError, match=rf"a{suffix}: ") as caught:
        files.write(frame, OutputSettings(view="Raw"), path)
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == b"the frame before"
    assert list(tmp_path.iterdir()) == [path]


def test_an_interrupted_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(film: Film, names: tuple[str, ...], output: OutputSettings, path: Path) -> None:
        path.write_bytes(b"half a pic")
        raise KeyboardInterrupt

    monkeypatch.setattr(files, "encode", interrupted)
    with pytest.raises(KeyboardInterrupt):
        files.write(film("beauty"), DEFAULT, tmp_path / "a.exr")
    assert not list(tmp_path.iterdir())


def test_threads_write_beside_one_another(tmp_path: Path) -> None:
    frames = [with_beauty(np.full((64, 64, 4), value)) for value in (0.25, 0.5, 0.75, 1.0)]
    paths = [tmp_path / f"{index}.exr" for index in range(len(frames))]
    threads = [threading.Thread(target=files.write, args=(f, DEFAULT, p)) for f, p in zip(frames, paths, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [reading.read(path)["beauty"].mean() for path in paths] == [0.25, 0.5, 0.75, 1.0]


def test_folders_are_made(tmp_path: Path) -> None:
    path = tmp_path / "shots" / "010" / "a.exr"
    files.check_writable(path)
    assert not path.parent.exists()
    files.write(film("beauty"), DEFAULT, path)
    assert path.is_file()


def test_written_files_have_the_usual_permissions(tmp_path: Path) -> None:
    (path,) = files.write(film("beauty"), DEFAULT, tmp_path / "a.exr")
    plain = tmp_path / "plain"
    plain.touch()
    assert path.stat().st_mode == plain.stat().st_mode


def test_places_that_cannot_be_written_are_known_beforehand(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder.exr").mkdir()
    for name in ("file/a.exr", "folder.exr", f"{'x' * 300}.exr"):
        with pytest.raises(OutputError):
            files.check_writable(tmp_path / name)
        with pytest.raises(OutputError):
            files.write(film("beauty"), DEFAULT, tmp_path / name)
    files.check_writable(tmp_path / "a.exr")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder.exr"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_locked_folder_is_known_beforehand(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="Permission denied"):
        files.check_writable(tmp_path / "a.exr")


@pytest.mark.parametrize("name", ["a", "a.mov", "a.exr.bak"])
def test_unknown_suffixes_name_the_known(name: str, tmp_path: Path) -> None:
    for call in (lambda path: check_format(path, DEFAULT), lambda path: files.write(film("beauty"), DEFAULT, path)):
        with pytest.raises(UsageError, match=r"\.exr, \.png"):
            call(tmp_path / name)


ARRANGEMENTS = [{"multipart": True}, {"tiled": True}, {"mipmaps": True}, {"multipart": True, "tiled": True}]


@pytest.mark.parametrize("arrangement", ARRANGEMENTS, ids=str)
def test_every_arrangement_of_an_exr_holds_the_same(arrangement: dict[str, bool], tmp_path: Path) -> None:
    frame = film()
    files.write(frame, DEFAULT, tmp_path / "plain.exr")
    files.write(frame, OutputSettings(**arrangement, verify=True), tmp_path / "arranged.exr")
    plain, arranged = reading.read(tmp_path / "plain.exr"), reading.read(tmp_path / "arranged.exr")
    assert set(plain) == set(arranged)
    for name, pixels in plain.items():
        np.testing.assert_array_equal(arranged[name], pixels)


def test_parts_are_named_after_their_layers(tmp_path: Path) -> None:
    files.write(film("beauty", "depth", "normal"), OutputSettings(multipart=True), tmp_path / "a.exr")
    source = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    names = []
    while source.seek_subimage(len(names), 0):
        names.append(source.spec().get_string_attribute("oiio:subimagename"))
    assert names == ["rgba", "depth", "normal"]


def test_mip_levels_are_means_down_to_one_pixel(tmp_path: Path) -> None:
    frame = film("position", size=(8, 4))
    files.write(frame, OutputSettings(mipmaps=True), tmp_path / "a.exr")
    source = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    levels = [source.read_image(0, level, 0, 3, oiio.FLOAT) for level in range(4)]
    assert [level.shape[:2] for level in levels] == [(4, 8), (2, 4), (1, 2), (1, 1)]
    pixels = frame.layers["position"]
    np.testing.assert_allclose(levels[3][0, 0], pixels.mean(axis=(0, 1)), rtol=1e-6)
    np.testing.assert_allclose(levels[1][1, 0], pixels[2:, :2].mean(axis=(0, 1)), rtol=1e-6)


@pytest.mark.parametrize("suffix", [".png", ".tif", ".jxl"])
@pytest.mark.parametrize("bits", [8, 16])
def test_bits_of_a_channel(suffix: str, bits: int, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    files.write(film("beauty"), OutputSettings(bits=bits), path)
    assert str(oiio.ImageInput.open(str(path)).spec().format) == f"uint{bits}"


def test_dither_keeps_the_mean_of_a_gradient_that_8_bits_would_round(tmp_path: Path) -> None:
    """A step of 0.25/255 below a rounding edge: without dither every pixel falls on the same side."""
    flat = np.full((256, 256, 3), 0.2 + 0.25 / 255, np.float32)
    output = OutputSettings(display="sRGB - Display", view="Raw")
    values = {}
    for dither in (False, True):
        files.write(
            with_beauty(np.dstack([flat, np.ones((256, 256))])), replace(output, dither=dither), tmp_path / "a.png"
        )
        values[dither] = reading.read(tmp_path / "a.png")["beauty"][..., 0] * 255
    assert np.ptp(values[False]) == 0
    assert values[True].mean() == pytest.approx(51.25, abs=0.05)


def test_the_data_window_stands_in_the_display_window(tmp_path: Path) -> None:
    frame = film("beauty", "depth", origin=(5, 3), display=(64, 48))
    files.write(frame, OutputSettings(verify=True), tmp_path / "a.exr")
    spec = oiio.ImageInput.open(str(tmp_path / "a.exr")).spec()
    assert (spec.x, spec.y, spec.width, spec.height) == (5, 3, *frame.size)
    assert (spec.full_width, spec.full_height) == (64, 48)
    np.testing.assert_array_equal(
        reading.read(tmp_path / "a.exr")["depth"][3 : 3 + frame.size[1], 5 : 5 + frame.size[0]], frame.layers["depth"]
    )


@pytest.mark.parametrize("output", [DEFAULT, OutputSettings(full_float=True), OutputSettings(compression="dwaa")])
def test_what_reads_back_otherwise_is_refused(
    output: OutputSettings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frame = film("beauty", "depth")
    other = replace(frame, layers=frame.layers | {"depth": frame.layers["depth"] + 1})
    real = files.encode
    monkeypatch.setattr(files, "encode", lambda film, *rest: real(other, *rest))
    with pytest.raises(OutputError, match="layer depth read back otherwise"):
        files.write(frame, replace(output, verify=True), tmp_path / "a.exr")
    assert not any(tmp_path.iterdir())


def test_a_text_file_appears_whole_and_a_stream_has_it_at_once(tmp_path: Path) -> None:
    write_text(tmp_path / "new" / "record.json", "{}\n")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["record.json"]
    from_there, writing = os.pipe()
    write_text(Path(f"/dev/fd/{writing}"), "told")
    os.close(writing)
    with os.fdopen(from_there) as told:
        assert told.read() == "told"
    with pytest.raises(OutputError, match=f"cannot write {tmp_path}: Is a directory"):
        write_text(tmp_path, "")
