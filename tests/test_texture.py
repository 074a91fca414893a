"""Textures: files to texels, texels to pixels."""

from __future__ import annotations

import logging
import struct
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from build import at, bulb, camera, drawable, quad, scene, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.textures import group_images
from defshade_cli.gpu.vertices import uv_slots
from defshade_cli.image import texture as images
from defshade_cli.image.texture import Source, TexelImage, load_images
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.geometry import Subset
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.texture import Channel, ImageFile, Texture, TextureInput
from defshade_cli.settings import RenderSettings
from defshade_cli.usd.reader import StageReader
from defshade_cli.usd.stage import open_stage

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
SIDE = 16
FULL_VIEW = camera(z=1.0, half=1.0)
"""Sees exactly the unit quad: pixel centres fall on texel centres of an image as large as the picture."""


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Iterator[Pipeline]:
    yield Pipeline(gpu)


def save(path: Path, pixels: NDArray, **attributes: str) -> ImageFile:
    """`pixels`, row 0 at the top, in their own type."""
    kind = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}[pixels.dtype.name]
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    for name, value in attributes.items():
        spec.attribute(name, value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec) and out.write_image(np.ascontiguousarray(pixels)) and out.close()
    return ImageFile(str(path))


def noise(channels: int, side: int = SIDE) -> NDArray[np.uint8]:
    return np.random.default_rng(1).integers(0, 256, (side, side, channels), np.uint8)


def linear(encoded: NDArray) -> NDArray:
    """IEC 61966-2-1."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def load(file: ImageFile, color_space: str = "auto") -> TexelImage:
    source = Source(file, color_space)  # type: ignore[arg-type]
    return load_images([source])[source]


def plain(file: ImageFile, **options: object) -> Texture:
    return Texture(((1001, file),), **options)  # type: ignore[arg-type]


def textured(inputs: dict[str, TextureInput], uv: NDArray | None = None, **fields: object) -> Scene:
    """The unit quad with a material; its uvs span the image once."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) if uv is None else uv
    mesh = replace(quad(), uvs={"st": corners})
    return scene([mesh], [sun()], [Material("/m", inputs=inputs, **fields)], FULL_VIEW)  # type: ignore[arg-type]


def layer(pipeline: Pipeline, built: Scene, name: str, size: int = SIDE) -> NDArray[np.float32]:
    plan = make_plan(built, RenderSettings(size=(size, size), layers=(name,)))
    return pipeline.render(built, plan).layers[name]


# Files


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


def test_a_missing_and_a_broken_file_are_logged_and_left_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "broken.png").write_bytes(b"no image")
    sources = [Source(ImageFile(str(tmp_path / name)), "auto") for name in ("missing.png", "broken.png")]
    with caplog.at_level(logging.WARNING, "defshade"):
        assert load_images(sources) == {}
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


def test_groups_never_pass_the_units() -> None:
    shapes = [(2 + i, 3 + j) for i in range(5) for j in range(5)]
    found = {
        Source(ImageFile(str(shape)), "auto"): TexelImage(np.zeros((*shape, 4), np.uint8), True) for shape in shapes
    }
    assert len(group_images(found, 32)) == 25
    few = group_images(found, 8)
    assert len(few) <= 8 and sum(map(len, few)) == 25
    assert all(len({image.texels.shape for image in group.values()}) == 1 for group in few)


# Pixels


@pytest.mark.parametrize(("color_space", "decoded"), [("auto", linear), ("raw", np.asarray)])
def test_a_texel_a_pixel_is_the_image(pipeline: Pipeline, tmp_path: Path, color_space: str, decoded: object) -> None:
    """To half a step of the 8-bit code in linear light, which drivers may decode with."""
    pixels = noise(4)
    texture = plain(save(tmp_path / "a.png", pixels), color_space=color_space)
    albedo = layer(pipeline, textured({"diffuse_color": TextureInput(texture)}), "albedo")
    np.testing.assert_allclose(albedo, decoded(pixels[..., :3] / 255), atol=2e-3)  # type: ignore[operator]


def test_channel_scale_and_bias(pipeline: Pipeline, tmp_path: Path) -> None:
    pixels = noise(3)
    texture = plain(save(tmp_path / "a.png", pixels), color_space="raw")
    roughness = TextureInput(texture, "g", scale=(0.5,) * 4, bias=(0.25,) * 4)
    found = layer(pipeline, textured({"roughness": roughness}), "roughness")
    np.testing.assert_allclose(found[..., 0], pixels[..., 1] / 255 * 0.5 + 0.25, atol=2e-3)


@pytest.mark.parametrize(
    ("channels", "channel", "source"),
    [(1, "g", 0), (1, "b", 0), (1, "a", None), (2, "b", 0), (2, "a", 1), (3, "a", None)],
)
def test_channels_that_an_image_lacks(
    pipeline: Pipeline, tmp_path: Path, channels: int, channel: Channel, source: int | None
) -> None:
    """One channel repeats, two are gray and alpha, and alpha that is missing is 1, as the UsdUVTexture schema says."""
    pixels = noise(channels)
    texture = plain(save(tmp_path / "a.png", pixels), color_space="raw")
    found = layer(pipeline, textured({"roughness": TextureInput(texture, channel)}), "roughness")
    expected = np.ones((SIDE, SIDE)) if source is None else pixels[..., source] / 255
    np.testing.assert_allclose(found[..., 0], expected, atol=2e-3)


@pytest.mark.parametrize("mode", ["black", "clamp", "repeat", "mirror"])
def test_wrap_modes_against_numpy(pipeline: Pipeline, tmp_path: Path, mode: str) -> None:
    """Three images a side, of which one is the image itself."""
    side = 8
    pixels = noise(3, side)
    texture = plain(save(tmp_path / "a.png", pixels), color_space="raw", wrap_s=mode, wrap_t=mode)
    uv = np.array([[-1, -1], [2, -1], [2, 2], [-1, 2]])
    found = layer(pipeline, textured({"diffuse_color": TextureInput(texture)}, uv), "albedo", 3 * side)
    pads = {"black": "constant", "clamp": "edge", "repeat": "wrap", "mirror": "symmetric"}
    expected = np.pad(pixels / 255, ((side, side), (side, side), (0, 0)), pads[mode])  # type: ignore[call-overload]
    np.testing.assert_allclose(found, expected, atol=2e-3)


def test_a_transform_moves_the_image(pipeline: Pipeline, tmp_path: Path) -> None:
    pixels = noise(3)
    texture = plain(save(tmp_path / "a.png", pixels), color_space="raw", wrap_s="repeat", wrap_t="repeat")
    quarter_turn = TextureInput(texture, texture_from_uv=((0.0, -1.0, 0.0), (1.0, 0.0, 0.0)))
    found = layer(pipeline, textured({"diffuse_color": quarter_turn}), "albedo")
    np.testing.assert_allclose(found, np.rot90(pixels / 255, -1), atol=2e-3)


def test_udim_tiles_and_holes(pipeline: Pipeline, tmp_path: Path) -> None:
    tiles = {number: np.full((4, 4, 3), value, np.uint8) for number, value in ((1001, 51), (1002, 102), (1012, 204))}
    files = tuple((number, save(tmp_path / f"{number}.png", pixels)) for number, pixels in tiles.items())
    texture = Texture(files, udim=True, color_space="raw")
    uv = np.array([[0, 0], [2, 0], [2, 2], [0, 2]])
    found = layer(pipeline, textured({"diffuse_color": TextureInput(texture)}, uv), "albedo", 8)
    np.testing.assert_allclose(found[2::4, 2::4, 0], [[0.0, 0.8], [0.2, 0.4]], atol=1e-3)


@pytest.mark.parametrize("size", [4, 10, 24, 64, 130, 500])
def test_udim_tiles_meet_without_a_seam(pipeline: Pipeline, tmp_path: Path, size: int) -> None:
    """A ramp over two tiles of 64 texels, whose far borders are as different as can be, smaller and larger than seen.

    Reading keeps half a texel from a tile's border, of the mip level below a pixel's size at the coarsest: the ramp
    stands still there for at most a pixel, or for half a texel where that is more. Blending around the tile would
    be off by 0.25 in the texel at the border.
    """
    ramp = np.round(np.broadcast_to((np.arange(128)[:, None] + 0.5) / 128 * 65535, (64, 128, 3))).astype(np.uint16)
    files = [(1001 + i, save(tmp_path / f"{i}.png", ramp[:, 64 * i : 64 * i + 64])) for i in (0, 1)]
    texture = Texture(tuple(files), udim=True, color_space="raw")
    uv = np.array([[0, 0], [2, 0], [2, 1], [0, 1]])
    found = layer(pipeline, textured({"diffuse_color": TextureInput(texture)}, uv), "albedo", size)[size // 2, :, 0]
    expected = (np.arange(size) + 0.5) / size
    assert np.abs(found - expected).max() <= max(1.0 / size, 0.5 / 128) + 1e-3
    assert (np.diff(found) >= -1e-3).all()


def test_minified_textures_are_averaged(pipeline: Pipeline, tmp_path: Path) -> None:
    checker = (np.indices((64, 64)).sum(0) % 2 * 255).astype(np.uint8)[..., None].repeat(3, 2)
    texture = plain(save(tmp_path / "a.png", checker), color_space="raw", wrap_s="clamp", wrap_t="clamp")
    found = layer(pipeline, textured({"diffuse_color": TextureInput(texture)}), "albedo", 8)
    np.testing.assert_allclose(found, 0.5, atol=0.01)


def test_an_unreadable_file_leaves_the_constant(pipeline: Pipeline, tmp_path: Path) -> None:
    texture = plain(ImageFile(str(tmp_path / "missing.png")))
    built = textured({"diffuse_color": TextureInput(texture)}, diffuse_color=(0.25, 0.5, 0.75))
    np.testing.assert_allclose(layer(pipeline, built, "albedo"), np.full((SIDE, SIDE, 3), (0.25, 0.5, 0.75)))


def test_subsets_may_name_different_coordinates(pipeline: Pipeline, tmp_path: Path) -> None:
    """Each half of the quad reads its own set, in its own material."""
    ramp = np.arange(SIDE, dtype=np.uint8)[None, :, None].repeat(SIDE, 0).repeat(3, 2) * 16
    texture = plain(save(tmp_path / "a.png", ramp), color_space="raw", wrap_s="clamp", wrap_t="clamp")
    materials = [Material(f"/{uv}", inputs={"diffuse_color": TextureInput(texture, uv=uv)}) for uv in ("a", "b")]
    at_left, at_right = np.full((4, 2), 0.5 / SIDE), np.full((4, 2), 1 - 0.5 / SIDE)
    mesh = replace(quad(), uvs={"a": at_left, "b": at_right})
    halves = (Subset(0, 0, 1), Subset(1, 1, 1))
    built = scene([mesh], [sun()], materials, FULL_VIEW, [replace(drawable(mesh), subsets=halves)])
    found = layer(pipeline, built, "albedo")[..., 0]
    np.testing.assert_allclose((found[SIDE - 2, SIDE // 2], found[1, SIDE // 2]), (0, 15 * 16 / 255), atol=2e-3)


def test_sets_that_share_no_mesh_share_a_slot() -> None:
    assert uv_slots([("st",), ("map1",)]) == {"st": 0, "map1": 0}
    assert uv_slots([("st", "map1"), ("map1", "map2")]) == {"st": 0, "map1": 1, "map2": 0}


def test_a_third_set_on_one_mesh_is_said(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "defshade"):
        assert uv_slots([("a", "b", "c")]) == {"a": 0, "b": 1}
    assert "coordinates c" in caplog.text


# Normal maps

TILT = np.array([0.6, 0.0, 0.8])
"""Towards +u."""


def tilted(tmp_path: Path) -> dict[str, TextureInput]:
    code = np.array([[np.round((TILT + 1) / 2 * 255)]]).repeat(4, 0).repeat(4, 1).astype(np.uint8)
    texture = plain(save(tmp_path / "n.png", code), color_space="raw", wrap_s="repeat", wrap_t="repeat")
    return {"normal": TextureInput(texture, scale=(2, 2, 2, 1), bias=(-1, -1, -1, 0))}


@pytest.mark.parametrize(
    ("placement", "mirrored", "expected"),
    [
        (np.eye(4), False, (0.6, 0.0, 0.8)),
        (np.eye(4), True, (-0.6, 0.0, 0.8)),
        (np.diag([-1.0, 1.0, 1.0, 1.0]), False, (-0.6, 0.0, 0.8)),
        (np.diag([2.0, 0.5, 3.0, 1.0]), False, (0.6, 0.0, 0.8)),
        (np.diag([-1.0, 1.0, -1.0, 1.0]), False, (0.6, 0.0, 0.8)),
    ],
)
def test_normal_maps_follow_the_coordinates(
    pipeline: Pipeline, tmp_path: Path, placement: NDArray, mirrored: bool, expected: tuple[float, ...]
) -> None:
    """u grows to the right, to the left, on a mirrored and on a scaled placement, and seen from behind.

    From behind, the surface that leans towards +u, now on the left, shows the other side of the same slope.
    """
    u = np.array([1, 0, 0, 1] if mirrored else [0, 1, 1, 0])
    built = textured(tilted(tmp_path), np.column_stack([u, [0, 0, 1, 1]]))
    built = replace(built, drawables=(drawable(built.meshes[0], where=[placement]),))
    normal = layer(pipeline, built, "normal")[SIDE // 2, SIDE // 2]
    np.testing.assert_allclose(normal, expected, atol=6e-3)


# Opacity


def half_cut(tmp_path: Path) -> dict[str, TextureInput]:
    ramp = np.zeros((4, 4, 4), np.uint8)
    ramp[:, 2:, 3] = 255
    texture = plain(save(tmp_path / "o.png", ramp), wrap_s="clamp", wrap_t="clamp")
    return {"opacity": TextureInput(texture, "a")}


def test_a_threshold_cuts_by_the_image_and_so_does_the_shadow(pipeline: Pipeline, tmp_path: Path) -> None:
    card = textured(half_cut(tmp_path), opacity_threshold=0.5)
    covered = layer(pipeline, card, "beauty")[..., 3]
    np.testing.assert_array_equal(covered[:, :6], 0)
    np.testing.assert_array_equal(covered[:, 10:], 1)
    wall = quad(half=4.0, z=-1.0)
    both = replace(
        card,
        meshes=(*card.meshes, wall),
        materials=(*card.materials, Material("/wall", diffuse_color=(1, 1, 1))),
        drawables=(*card.drawables, drawable(wall, 1, 1)),
        lights=(replace(bulb(0, 0, 1, intensity=100.0), radius=0.01),),
        camera=replace(FULL_VIEW, world_from_camera=at(0, 0, -0.5)),
    )
    lit = layer(pipeline, both, "beauty")[SIDE // 2, :, 0]
    assert (lit[: SIDE // 2 - 2] > 10 * max(lit[SIDE // 2 + 2 :].max(), 1e-9)).all()


def test_textures_make_the_plan_keep_what_they_need(tmp_path: Path) -> None:
    texture = TextureInput(plain(ImageFile("a.png")))
    built = textured({"opacity": texture, "emissive_color": texture, "clearcoat": texture, "ior": texture})
    plan = make_plan(built, RenderSettings(size=(8, 8)))
    assert plan.cutout and plan.textures
    assert {"emission", "clearcoat", "specular"} <= {plane.name for plane in plan.planes}
    assert built.textures == (texture.texture,)


# Packages


def test_a_texture_inside_a_package_is_drawn(pipeline: Pipeline, assets: Path) -> None:
    stage = assets / "wg_cesium_man" / "CesiumMan.usdz"
    if not stage.exists():
        pytest.skip("no package with textures")
    read = StageReader(open_stage(stage)).read(None)
    (texture,) = read.textures
    assert texture.tiles[0][1].contents
    albedo = layer(pipeline, read, "albedo", 64)
    assert len(np.unique(albedo.reshape(-1, 3), axis=0)) > 50


def test_a_header_that_claims_100000_texels_a_side_is_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 100_000, 100_000, 8, 2, 0, 0, 0))
    body = chunk(b"IDAT", zlib.compress(bytes(999))) + chunk(b"IEND", b"")
    (tmp_path / "huge.png").write_bytes(b"\x89PNG\r\n\x1a\n" + header + body)
    assert load_images([Source(ImageFile(str(tmp_path / "huge.png")), "auto")]) == {}
    assert "exceeds the 8192 MB limit" in caplog.text
    assert "\n" not in caplog.records[0].getMessage()
