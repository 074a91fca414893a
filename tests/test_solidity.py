"""Opacity from images that are 1 where surfaces read them: those are solid, and the plan says so."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from build import camera, quad, scene, sun
from defshade_cli.plan import Plan, make_plan
from defshade_cli.plan.solidity import solid_materials
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.texture import ImageFile, Texture, TextureInput
from defshade_cli.settings import RenderSettings
from texels import SIDE, save

CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)


def image(path: Path, alpha: NDArray) -> ImageFile:
    pixels = np.full((*alpha.shape, 4), 90, np.uint8)
    pixels[..., 3] = alpha
    return save(path / "base.png", pixels)


def shown(fed: TextureInput, uvs: NDArray = CORNERS, **of_material: object) -> Scene:
    material = Material("/m", inputs={"opacity": fed}, **of_material)  # type: ignore[arg-type]
    return scene([replace(quad(), uvs={"st": uvs})], [sun()], [material], camera())


def is_solid(fed: TextureInput, uvs: NDArray = CORNERS, **of_material: object) -> bool:
    return bool(solid_materials(shown(fed, uvs, **of_material)))


def planned(fed: TextureInput, uvs: NDArray = CORNERS) -> Plan:
    return make_plan(shown(fed, uvs), RenderSettings(size=(4, 4)))


@pytest.fixture
def white(tmp_path: Path) -> TextureInput:
    file = image(tmp_path, np.full((SIDE, SIDE), 255))
    return TextureInput(Texture(((1001, file),)), "a")


@pytest.fixture
def padded(tmp_path: Path) -> TextureInput:
    """1 in the right half alone."""
    alpha = np.zeros((SIDE, SIDE))
    alpha[:, SIDE // 2 :] = 255
    return TextureInput(Texture(((1001, image(tmp_path, alpha)),), wrap_s="repeat", wrap_t="repeat"), "a")


def test_the_plan_passes_images_over_that_are_1(white: TextureInput) -> None:
    plan = planned(white)
    assert not plan.cutout and not plan.transparent
    assert ("opacity images", "1 passed over") in [(d.subject, d.choice) for d in plan.decisions]


def test_one_texel_below_1_lets_light_through(tmp_path: Path) -> None:
    alpha = np.full((SIDE, SIDE), 255)
    alpha[3, 5] = 254
    fed = TextureInput(Texture(((1001, image(tmp_path, alpha)),)), "a")
    plan = planned(fed)
    assert plan.cutout and not any(d.subject == "opacity images" for d in plan.decisions)


def test_only_texels_under_the_triangles_count(padded: TextureInput) -> None:
    assert is_solid(padded, 0.1 + 0.3 * CORNERS + [0.5, 0.2])
    assert not is_solid(padded, 0.1 + 0.3 * CORNERS)
    assert not is_solid(padded, CORNERS)


def test_coordinates_repeat(padded: TextureInput) -> None:
    assert is_solid(padded, 0.1 + 0.3 * CORNERS + [7.5, -3.8])
    assert not is_solid(padded, 0.1 + 0.3 * CORNERS + [7.5, -3.8] - [0.5, 0.0])


def test_a_transform_of_coordinates_counts(padded: TextureInput) -> None:
    right = ((0.3, 0.0, 0.6), (0.0, 0.3, 0.1))
    assert is_solid(replace(padded, texture_from_uv=right))


@pytest.mark.parametrize(
    ("wrap", "solid"), [("useMetadata", False), ("black", False), ("clamp", True), ("repeat", True)]
)
def test_past_the_border_of_an_image_is_what_its_wrap_says(white: TextureInput, wrap: str, solid: bool) -> None:
    texture = replace(white.texture, wrap_s=wrap, wrap_t=wrap)
    assert is_solid(replace(white, texture=texture), 1.5 * CORNERS) is solid
    assert is_solid(replace(white, texture=texture))


def test_a_udim_set_is_0_where_it_has_no_tile(white: TextureInput) -> None:
    (_, file), *_ = white.texture.tiles
    pair = Texture(((1001, file), (1012, file)), udim=True)
    for offset, solid in (([0.0, 0.0], True), ([1.0, 1.0], True), ([1.0, 0.0], False)):
        assert is_solid(replace(white, texture=pair), 0.9 * CORNERS + offset) is solid


def test_scale_and_bias_count(white: TextureInput) -> None:
    half = (1.0, 1.0, 1.0, 0.5)
    assert not is_solid(replace(white, scale=half))
    assert is_solid(replace(white, scale=half, bias=(0.0, 0.0, 0.0, 0.5)))


def test_what_cannot_be_read_or_shows_one_side_is_left_to_the_shader(white: TextureInput) -> None:
    missing = Texture(((1001, ImageFile("/nowhere.png")),))
    assert not is_solid(replace(white, texture=missing))
    assert not is_solid(white, one_sided=True)


def test_a_missing_alpha_is_1(tmp_path: Path) -> None:
    file = save(tmp_path / "rgb.png", np.full((SIDE, SIDE, 3), 9, np.uint8))
    assert is_solid(TextureInput(Texture(((1001, file),)), "a"))
    assert not is_solid(TextureInput(Texture(((1001, file),)), "r"))
