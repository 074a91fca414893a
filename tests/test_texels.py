"""How large textures are seen, and that what is read of them is enough."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from build import at, camera, drawable, quad, scene, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.scene.texture import ImageFile, Texture, TextureInput
from defshade_cli.settings import RenderSettings
from texels import save


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Iterator[Pipeline]:
    yield Pipeline(gpu)


def seen(texture: Texture, distance: float, times: float = 1.0, instances: int = 1) -> Scene:
    """A quad 2 units wide that shows the image `times` times a side, seen by a camera of 90 degrees."""
    mesh = replace(quad(), uvs={"st": times * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])})
    material = Material("/m", inputs={"diffuse_color": TextureInput(texture)})
    placed = [at(0, 0, -float(n)) for n in range(instances)]
    eye = camera(z=distance, half=1.0)
    return scene([mesh], [sun()], [material], eye, [drawable(mesh, where=placed)])


def worth(built: Scene, size: int) -> float:
    (texels,) = make_plan(built, RenderSettings(size=(size, size))).texels.values()
    return texels


TEXTURE = Texture(((1001, ImageFile("a.png")),))


def test_twice_as_many_texels_as_pixels_are_kept() -> None:
    """128 pixels show 2 units at distance 1; 4 of them at distance 2."""
    assert worth(seen(TEXTURE, 1.0), 128) == 256
    assert worth(seen(TEXTURE, 2.0), 128) == 128
    assert worth(seen(TEXTURE, 2.5), 128) == 128, "the next power of two"
    assert worth(seen(TEXTURE, 1.0, times=4.0), 128) == 64
    assert worth(seen(TEXTURE, 1.0), 512) == 1024


def test_the_nearest_instance_counts() -> None:
    assert worth(seen(TEXTURE, 2.0, instances=5), 128) == 128


def test_what_has_no_coordinates_is_read_whole() -> None:
    built = seen(TEXTURE, 1.0)
    assert math.isinf(worth(replace(built, meshes=(replace(built.meshes[0], uvs={}),)), 128))


def test_a_crop_sees_the_same_texels() -> None:
    built = seen(TEXTURE, 1.0)
    (texels,) = make_plan(built, RenderSettings(size=(128, 128), crop=(0, 0, 16, 16))).texels.values()
    assert texels == 256


def test_what_is_seen_does_not_change(pipeline: Pipeline, tmp_path: Path) -> None:
    """Smooth noise of 512 texels a side on 32 pixels: read whole, and as large as it is worth."""
    rng = np.random.default_rng(1)
    pixels = np.kron(rng.integers(0, 256, (32, 32, 3)), np.ones((16, 16, 1))).astype(np.uint8)
    texture = Texture(((1001, save(tmp_path / "a.png", pixels)),), color_space="raw", wrap_s="clamp", wrap_t="clamp")
    built = seen(texture, 1.0)
    plan = make_plan(built, RenderSettings(size=(32, 32), layers=("albedo",)))
    assert plan.texels[texture] == 64
    small = pipeline.render(built, plan).layers["albedo"]
    whole = pipeline.render(built, replace(plan, texels={})).layers["albedo"]
    np.testing.assert_allclose(small, whole, atol=1.5 / 255)
