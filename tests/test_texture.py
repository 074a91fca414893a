"""Textures: texels to pixels."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from build import at, bulb, camera, drawable, quad, scene, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.vertices import sets_of, uv_slots
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.geometry import Subset
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.texture import Channel, ImageFile, Texture, TextureInput
from defshade_cli.settings import RenderSettings
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.reader import StageReader
from texels import SIDE, linear, noise, save

FULL_VIEW = camera(z=1.0, half=1.0)
"""Sees exactly the unit quad: pixel centres fall on texel centres of an image as large as the picture."""


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Iterator[Pipeline]:
    yield Pipeline(gpu)


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


# Pixels


@pytest.mark.parametrize(("color_space", "decoded"), [("auto", linear), ("raw", np.asarray)])
def test_a_texel_a_pixel_is_the_image(pipeline: Pipeline, tmp_path: Path, color_space: str, decoded: object) -> None:
    """To half a step of the 8-bit code in linear light, which drivers may decode with."""
    pixels = noise(4)
    texture = plain(save(tmp_path / "a.png", pixels), color_space=color_space)
    albedo = layer(pipeline, textured({"diffuse_color": TextureInput(texture)}), "albedo")
    np.testing.assert_allclose(albedo, decoded(pixels[..., :3] / 255), atol=2e-3)  # type: ignore[operator]


def test_an_edge_in_the_middle_of_a_pixel_leaves_its_neighbours_alone(pipeline: Pipeline, tmp_path: Path) -> None:
    """Of 64 samples each reads its own cell, an eighth of a pixel wide, and not what a pixel does.

    The image is kept at two texels a pixel, so that the edge is a ramp of half a pixel.
    """
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:, 34:] = 255
    glow = TextureInput(plain(save(tmp_path / "a.png", pixels), wrap_s="clamp", wrap_t="clamp"))
    black = {"diffuse_color": (0.0, 0.0, 0.0), "use_specular_workflow": True, "roughness": 1.0}
    built = replace(textured({"emissive_color": glow}, **black), lights=())
    plan = make_plan(built, RenderSettings(size=(SIDE, SIDE), samples=64))
    shown = pipeline.render(built, plan).layers["beauty"][..., 0]
    expected = np.where(np.arange(SIDE) < 8, 0.0, np.where(np.arange(SIDE) > 8, 1.0, 0.5))
    np.testing.assert_allclose(shown, np.broadcast_to(expected, shown.shape), atol=0.01)


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
    assert [sets_of(uv_slots([tuple(names)])) for names in ("", "ab", "abc")] == [2, 2, 8]


@pytest.mark.parametrize("count", [2, 3, 8])
def test_each_input_reads_its_own_set(pipeline: Pipeline, tmp_path: Path, count: int) -> None:
    """One texel of the image a set, of as many as materials can read."""
    ramp = np.arange(SIDE, dtype=np.uint8)[None, :, None].repeat(SIDE, 0).repeat(3, 2) * 16
    texture = plain(save(tmp_path / "a.png", ramp), color_space="raw")
    fields = ("roughness", "metallic", "diffuse_color", "opacity", "clearcoat", "occlusion", "ior", "emissive_color")
    inputs = {field: TextureInput(texture, "g", uv=f"uv{n}") for n, field in enumerate(fields[:count])}
    built = textured(inputs)
    uvs = {f"uv{n}": np.full((4, 2), (n + 0.5) / SIDE) for n in range(count)}
    built = replace(built, meshes=(replace(built.meshes[0], uvs=uvs),))
    for n, field in enumerate(fields[: min(count, 3)]):
        shown = layer(pipeline, built, "albedo" if field == "diffuse_color" else field)
        np.testing.assert_allclose(shown[SIDE // 2, SIDE // 2, 0], n * 16 / 255, atol=2e-3)
    if count == 8:
        emitted = layer(pipeline, built, "emission")
        np.testing.assert_allclose(emitted[SIDE // 2, SIDE // 2, 0], 7 * 16 / 255, atol=2e-3)
        assert np.isfinite(layer(pipeline, built, "beauty")).all(), "with the shadow of what is cut out"


def test_a_ninth_set_on_one_mesh_is_said(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "defshade"):
        assert uv_slots([tuple("abcdefghi")]) == {name: n for n, name in enumerate("abcdefgh")}
    assert "coordinates i" in caplog.text


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
