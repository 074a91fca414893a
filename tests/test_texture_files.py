"""Textures: files to texels."""

from __future__ import annotations

import logging
import math
import struct
import zlib
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from defshade_cli.gpu.textures import group_images
from defshade_cli.image import texture as images
from defshade_cli.image.texture import Source, TexelImage, load_images
from defshade_cli.scene.texture import ImageFile
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.reader import StageReader
from texels import SIDE, linear, load, noise, save

BACK_SLASHES = """#usda 1.0
def Cube "c" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </m>
}
def Material "m" {
    token outputs:surface.connect = </m/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </m/t.outputs:rgb>
        token outputs:surface
    }
    def Shader "t" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @.\\maps\\NAME@
        float3 outputs:rgb
    }
}
"""


@pytest.mark.parametrize("suffix", [".png", ".tif", ".tga", ".webp"])
def test_eight_bit_files_keep_their_bytes(tmp_path: Path, suffix: str) -> None:
    pixels = noise(3)
    path = tmp_path / f"image{suffix}"
    file = save(path, pixels, **({"compression": "lossless"} if suffix == ".webp" else {}))
    found = load(file)
    assert found.srgb
    np.testing.assert_array_equal(found.texels[::-1, :, :3], pixels)
    assert (found.texels[..., 3] == 255).all()


def test_a_jpeg_is_what_openimageio_decodes(tmp_path: Path) -> None:
    file = save(tmp_path / "image.jpg", noise(3))
    np.testing.assert_array_equal(load(file).texels[::-1, :, :3], oiio.ImageBuf(file.path).get_pixels(oiio.UINT8))


@pytest.mark.parametrize("suffix", [".exr", ".hdr"])
def test_float_files_become_half_and_stay_linear(tmp_path: Path, suffix: str) -> None:
    pixels = np.random.default_rng(2).random((SIDE, SIDE, 3)).astype(np.float32) * 8
    file = save(tmp_path / f"image{suffix}", pixels)
    stored = oiio.ImageBuf(file.path).get_pixels(oiio.FLOAT)
    found = load(file)
    assert found.texels.dtype == np.float16 and not found.srgb
    np.testing.assert_allclose(found.texels[::-1, :, :3], stored, rtol=2**-10)


def test_sixteen_bit_colours_are_linear_unless_called_srgb(tmp_path: Path) -> None:
    pixels = (noise(3).astype(np.uint16) * 257).astype(np.uint16)
    file = save(tmp_path / "image.png", pixels)
    np.testing.assert_allclose(load(file).texels[::-1, :, :3], pixels / 65535, rtol=2**-10, atol=1e-7)
    np.testing.assert_allclose(load(file, "sRGB").texels[::-1, :, :3], linear(pixels / 65535), rtol=2**-10, atol=1e-7)


def test_channels_are_filled_as_the_schema_says(tmp_path: Path) -> None:
    gray, gray_alpha, colors = noise(1), noise(2), noise(4)
    assert load(save(tmp_path / "gray.png", gray)).texels.shape == (SIDE, SIDE, 1)
    found = load(save(tmp_path / "gray_alpha.png", gray_alpha))
    assert not found.srgb
    np.testing.assert_array_equal(found.texels[::-1], gray_alpha[..., [0, 0, 0, 1]])
    np.testing.assert_array_equal(load(save(tmp_path / "rgba.png", colors)).texels[::-1], colors, "alpha is multiplied")


@pytest.mark.parametrize("name", ["wood.png", "wood.<UDIM>.png"])
def test_back_slashes_in_paths_are_slashes(tmp_path: Path, name: str) -> None:
    (tmp_path / "maps").mkdir()
    file = tmp_path / "maps" / name.replace("<UDIM>", "1001")
    save(file, noise(3))
    (tmp_path / "s.usda").write_text(BACK_SLASHES.replace("NAME", name))
    scene = StageReader(open_stage(tmp_path / "s.usda")).read(None)
    (texture,) = scene.textures
    assert [Path(tile.path) for _, tile in texture.tiles] == [file]
    assert not scene.unsupported


@pytest.mark.parametrize("name", ["maps/wood.<UDIM>.png", "maps\\wood.1001.png"])
def test_paths_start_from_the_layer_that_says_them(tmp_path: Path, name: str) -> None:
    """A stronger layer in another folder says but a note on the same attribute."""
    for folder in ("maps", "light"):
        (tmp_path / folder).mkdir()
    save(tmp_path / "maps" / "wood.1001.png", noise(3))
    (tmp_path / "s.usda").write_text(BACK_SLASHES.replace("maps\\NAME", name))
    note = 'over "m" {\nover "t" {\nasset inputs:file (doc = "as lit")\n}\n}'
    (tmp_path / "light" / "s.usda").write_text(f"#usda 1.0\n(subLayers = [@../s.usda@])\n{note}\n")
    scene = StageReader(open_stage(tmp_path / "light" / "s.usda")).read(None)
    assert [Path(tile.path).name for texture in scene.textures for _, tile in texture.tiles] == ["wood.1001.png"]
    assert not scene.unsupported


def test_a_missing_and_a_broken_file_are_logged_and_left_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "broken.png").write_bytes(b"no image")
    sources = [Source(ImageFile(str(tmp_path / name)), "auto") for name in ("missing.png", "broken.png")]
    with caplog.at_level(logging.WARNING, "defshade"):
        assert load_images(dict.fromkeys(sources, math.inf)) == {}
    assert "missing.png" in caplog.text and "broken.png" in caplog.text


def test_large_images_are_reduced_and_a_full_budget_halves_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = save(tmp_path / "flat.png", np.full((128, 256, 3), 77, np.uint8))
    monkeypatch.setattr(images, "LARGEST", 128)
    found = load(file).texels
    assert found.shape == (64, 128, 4) and (found[..., :3] == 77).all()
    monkeypatch.setattr(images, "BUDGET", 64 * 32 * 4 * 4 // 3 + 1)
    assert load(file).texels.shape == (32, 64, 4)


def test_a_budget_is_shared_by_all_images(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first is read whole, and halved once the others are there; what was small enough stays as it is."""
    sides = (256, 256, 64, 256)
    files = [save(tmp_path / f"{i}.png", noise(3, side)) for i, side in enumerate(sides)]
    monkeypatch.setattr(images, "BUDGET", (3 * 128**2 + 64**2) * 4 * 4 / 3 + 1)
    found = load_images({Source(file, "raw"): math.inf for file in files})
    assert [image.texels.shape[0] for image in found.values()] == [128, 128, 64, 128]
    np.testing.assert_array_equal(found[Source(files[0], "raw")].texels, found[Source(files[3], "raw")].texels)


@pytest.mark.parametrize(("suffix", "off"), [(".png", {"atol": 1.0}), (".exr", {"rtol": 1e-3})])
def test_an_image_twice_or_four_times_too_large_becomes_means(
    suffix: str, off: dict[str, float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the light of 4x4 texels: bytes are rounded twice, by half a step each time; half floats have eleven bits."""
    noisy = np.random.default_rng(4).integers(0, 256, (64, 32, 3), dtype=np.uint8)
    file = save(tmp_path / f"noise{suffix}", noisy if suffix == ".png" else noisy.astype(np.float32))
    monkeypatch.setattr(images, "LARGEST", 16)
    found = load(file).texels[::-1, :, :3].astype(np.float64)
    light = linear(noisy / 255) if suffix == ".png" else noisy
    means = light.reshape(16, 4, 8, 4, 3).mean(axis=(1, 3))
    if suffix == ".png":
        means = 255 * np.where(means <= 0.0031308, 12.92 * means, 1.055 * means ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(found, means, **{"rtol": 0.0, **off})


def test_an_image_is_read_no_larger_than_it_is_worth(tmp_path: Path) -> None:
    """Halved as often as it takes; means are of light, so that black and white squares stay as bright as they are."""
    checker = (np.indices((256, 256)).sum(0) % 2 * 255).astype(np.uint8)[..., None].repeat(3, 2)
    source = Source(save(tmp_path / "checker.png", checker), "auto")
    (found,) = load_images({source: 64.0}).values()
    assert found.texels.shape == (64, 64, 4) and found.srgb
    np.testing.assert_allclose(linear(found.texels[..., :3] / 255), 0.5, atol=4e-3)
    raw = Source(source.file, "raw")
    assert (load_images({raw: 64.0})[raw].texels[..., :3] == 128).all()


def test_a_file_with_mip_levels_is_read_at_one_of_them(tmp_path: Path) -> None:
    pixels = np.zeros((256, 256, 3), np.float32)
    oiio.ImageBufAlgo.make_texture(oiio.MakeTxTexture, oiio.ImageBuf(pixels), str(tmp_path / "a.exr"))
    with_mips = oiio.ImageBuf(str(tmp_path / "a.exr"))
    assert with_mips.nmiplevels > 3
    source = Source(ImageFile(str(tmp_path / "a.exr")), "auto")
    assert load_images({source: 64.0})[source].texels.shape[:2] == (64, 64)
    assert load_images({source: 100.0})[source].texels.shape[:2] == (100, 100)


def test_groups_never_pass_the_units() -> None:
    shapes = [(2 + i, 3 + j) for i in range(5) for j in range(5)]
    found = {
        Source(ImageFile(str(shape)), "auto"): TexelImage(np.zeros((*shape, 4), np.uint8), True) for shape in shapes
    }
    assert len(group_images(found, 32)) == 25
    few = group_images(found, 8)
    assert len(few) <= 8 and sum(map(len, few)) == 25
    assert all(len({image.texels.shape for image in group.values()}) == 1 for group in few)


def test_a_header_that_claims_100000_texels_a_side_is_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 100_000, 100_000, 8, 2, 0, 0, 0))
    body = chunk(b"IDAT", zlib.compress(bytes(999))) + chunk(b"IEND", b"")
    (tmp_path / "huge.png").write_bytes(b"\x89PNG\r\n\x1a\n" + header + body)
    assert load_images({Source(ImageFile(str(tmp_path / "huge.png")), "auto"): math.inf}) == {}
    assert "exceeds the 8192 MB limit" in caplog.text
    assert "\n" not in caplog.records[0].getMessage()
