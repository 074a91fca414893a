"""Light in parts: lobes, groups, shadows and what lights cost."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from build import at, beauty, bulb, camera, drawable, quad, rotated, scene, sphere, sun
from defshade_cli import render
from defshade_cli.errors import UsageError
from defshade_cli.gpu.context import Gpu
from defshade_cli.gpu.outputs import outputs_source
from defshade_cli.image.files import write
from defshade_cli.image.layers import resolve
from defshade_cli.image.reading import read
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.plan.groups import group_lights
from defshade_cli.scene.light import DomeLight, Light
from defshade_cli.scene.material import Material
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import OutputSettings, RenderSettings

SHINY = Material("/shiny", diffuse_color=(0.6, 0.3, 0.1), roughness=0.3, clearcoat=0.5, clearcoat_roughness=0.3)
GLOWING = Material("/glowing", emissive_color=(0.2, 0.4, 0.1))
SKY = DomeLight(path="/sky", world_from_light=np.eye(4), color=(0.2, 0.3, 0.5), group="outside")


def lights() -> list[Light]:
    key = replace(bulb(1, 1, 2), path="/rig/key")
    rim = replace(bulb(-1, 1, 2, cone=40.0), path="/rig/rim_1", group="rims")
    return [replace(sun(), path="/sun", group="outside"), SKY, key, rim]


def stage(materials: Sequence[Material] = (SHINY, GLOWING)) -> Scene:
    where = [drawable(sphere(0.8), 0, 0), drawable(quad(1.6, z=-1.0), 1, len(materials) - 1)]
    return scene([sphere(0.8), quad(1.6, z=-1.0)], lights(), materials, camera(5.0), where)


def rig_alone(of: Scene) -> Scene:
    return replace(of, lights=tuple(light for light in of.lights if light.path.startswith("/rig")))


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def drawn(pipeline: Pipeline, of: Scene, *layers: str, **options: object) -> dict[str, NDArray[np.float32]]:
    return pipeline.render(of, make_plan(of, RenderSettings(size=(48, 48), layers=layers, **options))).layers  # type: ignore[arg-type]


# Half the step of a half float at the brightest, twice as many roundings of float32 and less than a thousandth of it.
ROUNDING = {"rtol": 2.0**-11, "atol": 1e-5}


@pytest.mark.parametrize("options", [{}, {"samples": 8}, {"samples": 2, "layout": "rgba8"}, {"shading": "classic"}])
def test_groups_add_up_to_the_beauty(pipeline: Pipeline, options: dict[str, object]) -> None:
    """Emission and the background's sky included."""
    groups = ("light:outside", "light:rims", "light:default")
    layers = drawn(pipeline, stage(), "beauty", *groups, **options)
    np.testing.assert_allclose(sum(layers[name] for name in groups), beauty(layers), **ROUNDING)
    assert all(layers[name].max() > 0 for name in groups)


@pytest.mark.parametrize("options", [{}, {"samples": 8}, {"shading": "classic"}])
def test_lobes_add_up_to_the_light_on_surfaces(pipeline: Pipeline, options: dict[str, object]) -> None:
    layers = drawn(pipeline, stage([SHINY]), "beauty", "diffuse", "specular", background=False, **options)
    np.testing.assert_allclose(layers["diffuse"] + layers["specular"], beauty(layers), **ROUNDING)
    assert layers["diffuse"].max() > 0.1 and layers["specular"].max() > 0.1


def test_lobes_are_those_of_the_materials(pipeline: Pipeline) -> None:
    """Metal has no diffuse lobe; without emission and sky the rest of the light is specular."""
    metal = Material("/metal", metallic=1.0, roughness=0.5)
    layers = drawn(pipeline, stage([metal]), "diffuse", "specular")
    assert not layers["diffuse"].any() and layers["specular"].any()


def test_a_group_is_what_its_lights_alone_give(pipeline: Pipeline) -> None:
    of = stage([SHINY])
    alone = rig_alone(of)
    grouped = drawn(pipeline, of, "light:/rig/*", samples=4)["light:/rig/*"]
    # Alone the lights are other numbers of the sampling pattern: at one point each they are the same.
    single, of_alone = drawn(pipeline, of, "light:/rig/*")["light:/rig/*"], beauty(drawn(pipeline, alone, "beauty"))
    # Alone their maps lie elsewhere in the atlas: where a texel's slope may be taken two ways, rounding then decides.
    assert np.isclose(single, of_alone, rtol=1e-4, atol=1e-5).mean() > 0.999
    np.testing.assert_allclose(single, of_alone, rtol=1e-2, atol=1e-5)
    assert grouped.mean() == pytest.approx(single.mean(), rel=0.2)


def test_a_group_without_shadows_is_to_the_bit_what_its_lights_alone_give(pipeline: Pipeline) -> None:
    of = stage([SHINY])
    alone = rig_alone(of)
    grouped = drawn(pipeline, of, "light:/rig/*", shadows=False)["light:/rig/*"]
    np.testing.assert_array_equal(grouped, beauty(drawn(pipeline, alone, "beauty", shadows=False)))


def test_groups_go_by_group_name_or_path() -> None:
    layers = ("light:outside", "light:rim*", "light:/rig/*", "light:key", "light:default")
    found = group_lights(lights(), layers, ())
    assert found == [
        ("light:outside",),
        ("light:outside",),
        ("light:/rig/*", "light:key"),
        ("light:rim*", "light:/rig/*"),
    ]
    assert group_lights(lights(), ("light:key", "light:default"), ())[0] == ("light:default",)


def test_a_group_without_lights_is_black_and_told(pipeline: Pipeline, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "defshade"):
        layers = drawn(pipeline, stage(), "light:nobody")
    assert not layers["light:nobody"].any()
    assert caplog.messages == ["light:nobody: no light has such a group, name or path"]


def test_too_many_groups_of_one_light_are_refused() -> None:
    layers = tuple(f"light:{'*' * n}" for n in range(1, 9))
    with pytest.raises(UsageError, match="/sun is in more than 7 of the light groups"):
        group_lights(lights(), layers, ())


def test_groups_that_would_share_a_name_in_files_are_refused() -> None:
    with pytest.raises(UsageError, match="light_key"):
        resolve(["light:key", "light:/key"])
    assert resolve(["RGBA_key"]) == ("light:key",)


def test_shadow_is_the_share_of_light_that_arrives(pipeline: Pipeline) -> None:
    """A quad in the shadow of another from one of two lights of the same strength: a half."""
    tilted = [replace(sun(), path=f"/{axis}", world_from_light=rotated("x", axis)) for axis in (50.0, -50.0)]
    floor, card = quad(4.0), quad(0.7)
    of = scene(
        [floor, card], tilted, view=camera(5.0), drawables=[drawable(floor), drawable(card, 1, where=[at(0, 0, 1)])]
    )
    layers = drawn(pipeline, of, "shadow", "depth")
    on_floor = layers["depth"][..., 0] > 4.5
    values = layers["shadow"][..., 0][on_floor]
    assert ((values > 0.99) | (abs(values - 0.5) < 0.01)).mean() > 0.95
    assert (abs(values - 0.5) < 0.01).mean() > 0.05


def test_shadow_is_one_where_nothing_is_hidden_and_on_the_background(pipeline: Pipeline) -> None:
    of = scene([sphere()], [bulb(0, 0, 3)])
    assert (drawn(pipeline, of, "shadow", shadows=False)["shadow"] == 1.0).all()
    assert drawn(pipeline, of, "shadow", samples=4)["shadow"][0, 0] == 1.0


def test_light_complexity_counts_volumes(pipeline: Pipeline) -> None:
    """The sun reaches all that is covered, a bulb only what its reach touches; the background none."""
    near = replace(bulb(0.0, 0.0, 0.3, intensity=1e-5), path="/near", treat_as_point=True)
    of = scene([quad(1.0)], [sun(), near], view=camera(5.0))
    layers = drawn(pipeline, of, "lightComplexity", "position", "alpha", light_tolerance=1e-3)
    (reach,) = [p.reach for p in make_plan(of, RenderSettings(light_tolerance=1e-3)).lights if p.light.path == "/near"]
    distance = np.linalg.norm(layers["position"] - near.position, axis=-1)
    covered, count = layers["alpha"][..., 0] > 0, layers["lightComplexity"][..., 0]
    within, beyond = covered & (distance < reach), covered & (distance > 1.1 * reach)
    assert within.any() and beyond.any()
    assert (count[within] == 2).all() and (count[beyond] == 1).all() and (count[~covered] == 0).all()


def test_files_name_groups_by_letters_alone(pipeline: Pipeline, tmp_path: Path) -> None:
    of = stage()
    plan = make_plan(of, RenderSettings(size=(16, 16), layers=("light:/rig/*", "light:outside")))
    film = pipeline.render(of, plan)
    for options in ({"verify": True}, {"verify": True, "multipart": True}):
        (path,) = write(film, OutputSettings(**options), tmp_path / "a.exr")
        assert set(read(path)) == {"light_rig", "light_outside"}
    split = write(film, OutputSettings(split_layers=True), tmp_path / "b.exr")
    assert sorted(file.name for file in split) == ["b.light_outside.exr", "b.light_rig.exr"]


def test_what_is_not_asked_is_not_compiled_nor_allocated(pipeline: Pipeline) -> None:
    plan = make_plan(stage(), RenderSettings(size=(16, 16)))
    assert not plan.outputs and not plan.groups and not plan.most_groups
    assert "light_output" not in outputs_source(plan.outputs, plan.most_groups)
    pipeline.render(stage(), plan)
    targets = pipeline._frame._lights[1]
    assert targets is not None and not targets.sums
    assert targets.of(()) is targets.radiance.framebuffer


@pytest.mark.parametrize(
    "attribute",
    ["inputs:lightGroup", "inputs:ri:light:lightGroup", "primvars:arnold:aov", "primvars:karma:light:lpetag"],
)
def test_groups_are_read_of_a_stage(attribute: str, tmp_path: Path) -> None:
    path = tmp_path / "a.usda"
    path.write_text(f"""#usda 1.0
def Sphere "ball" {{
}}
def DistantLight "one" {{
    string {attribute} = "key"
}}
def DistantLight "two" {{
}}
""")
    film = render(path, size=(16, 16), layers=("beauty", "light:key", "light:two"))
    assert film.layers["light:key"].any()
    np.testing.assert_allclose(film.layers["light:key"], film.layers["light:two"], rtol=1e-5)
