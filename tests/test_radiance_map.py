"""Images on rect lights: upright to what they light, sampled without bias, and read from a stage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from build import at, quad, scene
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.light_texture import with_texture
from defshade_cli.passes.emitters import light_batches
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.passes.sampling import samples as lit_samples
from defshade_cli.plan import make_plan
from defshade_cli.scene.emission import emitter_at
from defshade_cli.scene.light import RectLight
from defshade_cli.scene.material import Material
from defshade_cli.scene.radiance_map import RadianceMap
from defshade_cli.settings import RenderSettings
from defshade_cli.usd.reader import StageReader
from stages import reasons, stage_of

WHITE = Material("/white", diffuse_color=(1, 1, 1), roughness=1.0, ior=1.0)
GRID = [((i + 0.5) / 64, (j + 0.5) / 64) for i in range(64) for j in range(64)]


def noise(height: int, width: int) -> RadianceMap:
    """Of uneven brightness and paler colour: the density follows luminance alone."""
    rng = np.random.default_rng(5)
    return RadianceMap(
        rng.random((height, width, 1), np.float32) ** 4 * (1 + rng.random((height, width, 3), np.float32))
    )


def panel(**options: object) -> RectLight:
    """2 x 1 at the origin, shining along −Z."""
    return RectLight(path="/panel", world_from_light=np.eye(4), color=(1, 1, 1), width=2.0, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("shape", [(4, 4), (7, 3), (600, 530)])
def test_the_mean_of_samples_is_the_image(shape: tuple[int, int]) -> None:
    """A weight of mean 1, and places whose weighted mean is the image's centre of light."""
    shown = noise(*shape)
    places, weights = (np.array(a) for a in zip(*(shown.sample(u)[:2] for u in GRID), strict=True))
    np.testing.assert_allclose(weights.mean(axis=0), 1, rtol=0.02)
    x = (np.arange(shape[1]) + 0.5) / shape[1]
    centre = (shown.radiance * x[None, :, None]).mean(axis=(0, 1)) / shown.mean
    np.testing.assert_allclose((weights * places[:, :1]).mean(axis=0), centre, rtol=0.02)


def test_places_fall_where_the_light_is() -> None:
    image = np.zeros((4, 4, 3), np.float32)
    image[0, 1] = (0, 3, 0)
    for u in GRID[::97]:
        (s, t), weight, _ = RadianceMap(image).sample(u)
        assert 0.25 <= s <= 0.5 and 0 <= t <= 0.25
        np.testing.assert_allclose(weight, [0, 1, 0], atol=1e-12)
    np.testing.assert_array_equal(RadianceMap(np.zeros((2, 2, 3))).sample((0.5, 0.5))[1], 0)


def test_the_top_left_stands_at_plus_x_and_plus_y() -> None:
    """The schema: a texture's min coordinates are at (+X, +Y); so it is upright to what it lights."""
    image = np.zeros((2, 2, 3), np.float32)
    image[0, 0] = 4
    emitter = emitter_at(panel(radiance_map=RadianceMap(image)), (0.5, 0.5, 0.5), np.zeros(3))
    np.testing.assert_allclose(emitter.position, [0.5, 0.25, 0])
    np.testing.assert_allclose(emitter.intensity, 2.0, err_msg="the mean, 1, times the area: all light is in one place")


def test_normalize_divides_by_the_area_and_leaves_the_image() -> None:
    shown = RadianceMap(np.full((2, 2, 3), 0.5, np.float32))
    np.testing.assert_allclose(panel(radiance_map=shown, normalize=True).radiance, 0.25)


def test_an_image_lights_what_each_of_its_halves_lights(gpu: Gpu) -> None:
    """Left half red and right half blue are two rects of half the width; noise of 128 samples of each."""
    image = np.zeros((8, 8, 3), np.float32)
    image[:, :4, 0] = image[:, 4:, 2] = 1.0
    options = {"path": "/panel", "color": (1, 1, 1), "intensity": 3.0}
    whole = RectLight(**options, world_from_light=at(0, 0, 1), width=4.0, radiance_map=RadianceMap(image))
    halves = [
        RectLight(**options | {"color": color}, world_from_light=at(x, 0, 1), width=2.0)
        for x, color in ((1, (1, 0, 0)), (-1, (0, 0, 1)))
    ]
    pipeline = Pipeline(gpu)
    images = []
    for lights in ([whole], halves):
        of = scene([quad(5.0)], lights, [WHITE])
        plan = make_plan(of, RenderSettings(size=(32, 32), samples=128, shadows=False))
        images.append(pipeline.render(of, plan).layers["beauty"][..., :3])
    np.testing.assert_allclose(images[0], images[1], rtol=0.05, atol=0.02)
    assert images[0][16, 28, 0] > 2 * images[0][16, 28, 2], "red at +X"


@pytest.mark.parametrize("samples", [1, 16])
def test_few_points_have_the_colour_of_the_whole_image(samples: int) -> None:
    """All of a render together, however they fall on a small blue pane."""
    image = np.full((4, 4, 3), (1.0, 0.9, 0.2), np.float32)
    image[3, :2] = (0, 0, 4)
    light = panel(radiance_map=RadianceMap(image), normalize=True)
    of = scene([quad(5.0)], [light], [WHITE])
    plan = make_plan(of, RenderSettings(size=(8, 8), samples=samples))
    batches = [batch for sample in lit_samples(samples) for batch in light_batches(of, plan, sample)]
    total = sum(lit.emitter.intensity for batch in batches for lit in batch) / samples
    np.testing.assert_allclose(total, light.emission, rtol=1e-6)


def test_an_image_is_read_from_a_stage(tmp_path: Path) -> None:
    pixels = np.zeros((2, 4, 3), np.float32)
    pixels[0, 0] = 8
    assert oiio.ImageBuf(pixels).write(str(tmp_path / "face.exr"), "float")
    text = "".join(
        f'def RectLight "{name}" {{\nasset inputs:texture:file = @{tmp_path}/{name}.exr@\n}}\n'
        for name in ("face", "lost")
    )
    found = StageReader(stage_of('def Cube "cube" {}\n' + text)).read(None)
    face, lost = (with_texture(light) for light in found.lights)
    assert isinstance(face, RectLight) and face.radiance_map and isinstance(lost, RectLight)
    np.testing.assert_array_equal(face.radiance_map.radiance, pixels)
    np.testing.assert_allclose(face.emission, 1)
    assert lost.texture is None and "lost.exr is ignored: there is no such file" in reasons(found, "/lost")[0]


def test_an_image_that_cannot_be_read_leaves_an_even_light(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "torn.png").write_bytes(b"no image")
    text = f'def Cube "cube" {{}}\ndef RectLight "light" {{\nasset inputs:texture:file = @{tmp_path}/torn.png@\n}}'
    (light,) = StageReader(stage_of(text)).read(None).lights
    assert with_texture(light).emission.tolist() == [1, 1, 1]
    assert "/light: its texture cannot be read" in caplog.text
