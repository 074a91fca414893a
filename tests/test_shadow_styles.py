"""UsdLuxShadowAPI: coloured shadows, and shadows that end at a distance from what casts them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from build import at, beauty, bulb, camera, quad, scene, sun
from defshade_cli.gpu.context import Gpu
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.light import Light
from defshade_cli.scene.material import Material
from defshade_cli.scene.shadow import PLAIN, ShadowStyle
from defshade_cli.settings import RenderSettings
from stages import read

WHITE = Material("/white", diffuse_color=(1, 1, 1), roughness=1.0, ior=1.0)
LIGHTS: dict[str, Light] = {"sun": sun(), "bulb": bulb(0, 0, 4.0, intensity=40.0)}


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def shadow(pipeline: Pipeline, light: Light, style: ShadowStyle, height: float = 1.0) -> NDArray[np.float64]:
    """(3,) light in the shadow of a square at `height` over a wall, over what arrives without the square's shadow.

    The eye looks from below the square, past nothing.
    """
    view = replace(camera(), world_from_camera=at(0.0, 0.0, 0.5 * height), clipping_range=(0.01, 100.0))
    light = replace(light, shadow=style)
    of = scene([quad(5.0), quad(0.4, height)], [light], [WHITE], view)
    images = [
        beauty(pipeline.render(of, make_plan(of, RenderSettings(size=(16, 16), shadows=s))).layers)[8, 8]
        for s in (True, False)
    ]
    return images[0] / images[1]


@pytest.mark.parametrize("kind", LIGHTS)
def test_a_shadow_leaves_its_colour_of_the_light(pipeline: Pipeline, kind: str) -> None:
    left = shadow(pipeline, LIGHTS[kind], ShadowStyle(color=(0.5, 0.1, 0.0)))
    np.testing.assert_allclose(left, [0.5, 0.1, 0.0], atol=1e-5)


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize(("distance", "left"), [(-1.0, 0.0), (1.1, 0.0), (0.9, 1.0), (0.0, 1.0)])
def test_a_shadow_ends_at_its_distance(pipeline: Pipeline, kind: str, distance: float, left: float) -> None:
    np.testing.assert_allclose(shadow(pipeline, LIGHTS[kind], ShadowStyle(distance=distance)), left, atol=1e-5)


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("gamma", [1.0, 2.0, 0.5])
def test_a_shadow_fades_within_its_falloff(pipeline: Pipeline, kind: str, gamma: float) -> None:
    """The occluder is 1 away; in a zone of 0.8 before 1.5, 0.5 / 0.8 of it is left, to the power of gamma."""
    style = ShadowStyle(distance=1.5, falloff=0.8, gamma=gamma)
    # 1 %: a map's depth offset moves its occluders by less than a texel.
    np.testing.assert_allclose(shadow(pipeline, LIGHTS[kind], style), 1 - (0.5 / 0.8) ** gamma, atol=0.01)


def test_the_falloff_is_no_deeper_than_the_distance() -> None:
    assert ShadowStyle(distance=1.0, falloff=3.0).fading == 1.0
    assert ShadowStyle(falloff=3.0).fading == PLAIN.fading == 0.0


def test_styles_are_read_whether_or_not_the_api_is_applied(pipeline: Pipeline) -> None:
    body = """color3f inputs:shadow:color = (0.25, 0, 1)
        float inputs:shadow:distance = 3
        float inputs:shadow:falloff = 2
        float inputs:shadow:falloffGamma = 0.5
        bool inputs:shadow:enable = 0"""
    text = f"""def Cube "cube" {{
    }}
    def SphereLight "styled" (prepend apiSchemas = ["ShadowAPI"]) {{
        {body}
    }}
    def SphereLight "plain" {{
        {body}
    }}
    def SphereLight "fallback" (prepend apiSchemas = ["ShadowAPI"]) {{
    }}
    """
    styled, plain, fallback = read(text).lights
    assert (styled.shadow, styled.casts_shadow) == (ShadowStyle((0.25, 0, 1), 3, 2, 0.5), False)
    assert (plain.shadow, plain.casts_shadow) == (styled.shadow, styled.casts_shadow)
    assert (fallback.shadow, fallback.casts_shadow) == (PLAIN, True)


def test_plain_shadows_pay_nothing(pipeline: Pipeline) -> None:
    plain = scene([quad(5.0)], [sun()], [WHITE])
    assert not make_plan(plain, RenderSettings()).shadow_styles
    styled = scene([quad(5.0)], [replace(sun(), shadow=ShadowStyle(distance=2.0))], [WHITE])
    assert make_plan(styled, RenderSettings()).shadow_styles
    assert not make_plan(styled, RenderSettings(shadows=False)).shadow_styles
