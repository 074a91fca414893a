"""Frames of which a part is drawn anew hold what they hold when all of them is drawn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from build import scene, sun
from defshade_cli.image.film import Film
from defshade_cli.passes.screen import Narrowing
from defshade_cli.plan import make_plan, plan_after
from defshade_cli.rendering import Renderer, run
from defshade_cli.settings import RenderJob, RenderSettings
from stages import move

CAMERA = f"""def Camera "camera" {{
    double shutter:close = 0.5
    float focalLength = 30
    {move(y=2, z=12)}
}}
"""
SUN = """def DistantLight "sun" {
    float inputs:intensity = 2
    float3 xformOp:rotateXYZ = (-60, 20, 0)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
}
"""
BULB = f"""def SphereLight "bulb" {{
    float inputs:intensity = 60
    float inputs:radius = 0.05
    {move(3, 5, 2)}
}}
"""
FADING = BULB.replace('"bulb"', '"bulb" (prepend apiSchemas = ["ShadowAPI"])').replace(
    "float inputs:radius",
    "float inputs:shadow:distance = 4\n    float inputs:shadow:falloff = 3\n    float inputs:radius",
)
PANEL = f"""def RectLight "panel" {{
    float inputs:intensity = 5
    float inputs:width = 3
    float3 xformOp:rotateXYZ = (-80, 10, 0)
    {move(0, 7, 1).replace('["', '["xformOp:rotateXYZ", "')}
}}
"""
AROUND = "".join(
    f"""def SphereLight "bulb_{number}" {{
    float inputs:intensity = 200
    float inputs:radius = 0.05
    {move(x, 2.5, 3)}
}}
def Sphere "ball_{number}" {{
    {move(x, -0.2, -2)}
}}
"""
    for number, x in enumerate((-4, 0, 4))
)
FLOOR = f"""def Cube "floor" {{
    double size = 40
    {move(y=-21)}
}}
def Sphere "still" {{
    {move(3, 3)}
}}
"""
MOVING = """
    double radius = 0.5
    double3 xformOp:translate.timeSamples = { 1: (-3, 2, 0), 2: (-2.7, 2.4, 0.3), 3: (-2.2, 2, 0), 4: (-2.2, 2, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
"""
LOOK = """def Material "look" {
    token outputs:surface.connect = </look/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
        float inputs:opacity = 0.6
        float inputs:roughness = 0.15
        color3f inputs:emissiveColor = (0.2, 0, 0)
    }
}
"""
BALL = f"""def Sphere "ball" {{
    {MOVING}
}}
"""
HIGHEST = BALL.replace("2, 0)", "4.1, 0)").replace("2.4, 0.3", "4.2, 0.3")
GLASS = f"""{LOOK}def Sphere "ball" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    rel material:binding = </look>
    {MOVING}
}}
"""
INSTANCES = """def PointInstancer "many" {
    int[] protoIndices = [0, 0, 0]
    point3f[] positions.timeSamples = { 1: [(-3, 0, 0), (0, 1, 0), (2, 0, 2)], 2: [(-3, 0, 0), (0, 1.3, 0), (2, 0, 2)] }
    rel prototypes = </many/ball>
    def Sphere "ball" {
        double radius = 0.5
    }
}
"""
TURNED = BULB.replace("float inputs:intensity = 60", "float inputs:intensity.timeSamples = { 1: 60, 4: 30 }")
DOME = 'def DomeLight "sky" {}\n'
DATA = ("beauty", "alpha", "depth", "normal", "position", "primId", "instanceId", "uv", "albedo", "specular")
SIZE = (192, 144)


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with Renderer() as renderer:
        yield renderer


def job_of(text: str, folder: Path, frames: tuple[float, ...], settings: dict[str, Any]) -> RenderJob:
    path = folder / "stage.usda"
    path.write_text(f"#usda 1.0\n{CAMERA}{text}")
    return RenderJob(path, frames, settings=RenderSettings(**{"size": SIZE, "shadows": False} | settings))


def drawn(job: RenderJob, renderer: Renderer) -> tuple[list[Film], list[str]]:
    """The films of all frames, and how much of each was drawn."""
    films, choices = [], []
    for result in run(job, renderer=renderer):
        (image,) = result.images
        assert image.film
        assert image.plan
        films.append(image.film)
        choices += [decision.choice for decision in image.plan.decisions if decision.subject == "redrawing"]
    return films, choices


@pytest.mark.parametrize(
    ("moving", "settings"),
    [
        (BALL, {}),
        (BALL, {"samples": 3, "filter": "gaussian", "layers": DATA}),
        (BALL, {"samples": 2, "layout": "rgba8", "lighting": "volumes"}),
        (BALL, {"layout": "packed", "lighting": "tiles"}),
        (GLASS, {"samples": 3, "layers": ("beauty", "diffuse", "light:bulb")}),
        (INSTANCES, {"layers": DATA}),
        (BALL, {"layers": ("motionForward", "motionBackward")}),
        (BALL, {"layers": ("depth",)}),
        (BALL, {"shadows": True, "layers": ("beauty", "shadow"), "lighting": "whole"}),
        (HIGHEST, {"shadows": True, "layers": DATA, "lighting": "whole"}),
        (AROUND + BALL, {"shadows": True, "lighting": "whole"}),
        (AROUND + BALL, {"shadows": True, "lighting": "tiles"}),
        (AROUND + BALL, {"shadows": True, "lighting": "volumes"}),
        (FADING.replace("bulb", "fading") + BALL, {"shadows": True, "lighting": "whole"}),
        (GLASS, {"shadows": True, "lighting": "whole"}),
        (PANEL + BALL, {"shadows": True, "light_points": 2, "layout": "packed", "lighting": "tiles"}),
        (BALL, {"shadows": True, "samples": 3, "lighting": "volumes"}),
        (GLASS, {"shadows": True, "samples": 2, "lighting": "tiles"}),
    ],
    ids=[
        *("plain", "data", "volumes", "tiles", "glass", "instances", "motion", "depth", "shadows", "highest"),
        *("around", "around tiles", "around volumes", "fading", "glassy", "panel", "soft", "thin"),
    ],
)
def test_a_part_is_drawn_and_the_picture_is_equal(
    moving: str, settings: dict[str, Any], tmp_path: Path, renderer: Renderer
) -> None:
    job = job_of(SUN + BULB + FLOOR + moving, tmp_path, (1.0, 2.0, 3.0, 4.0), {"motion_blur": False} | settings)
    films, choices = drawn(job, renderer)
    assert choices == ["all", "a part", "a part", "a part"]
    for frame, film in zip(job.frames, films, strict=True):
        ((alone,), _) = drawn(replace(job, frames=(frame,)), renderer)
        assert film.manifests == alone.manifests
        for name, pixels in alone.layers.items():
            np.testing.assert_array_equal(film.layers[name], pixels, err_msg=name)


def test_shadows_that_stay_are_not_drawn_again(
    tmp_path: Path, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts: list[Any] = []
    of = Narrowing.of
    monkeypatch.setattr(Narrowing, "of", lambda *told: (parts.append(told[1]), of(*told))[1])
    job = job_of(SUN + BULB + FLOOR + BALL, tmp_path, (1.0, 2.0, 3.0), {"shadows": True, "lighting": "whole"})
    drawn(job, renderer)
    assert parts[0] is None
    assert all(part.seen is not None and part.tiles.mean() < 0.4 for part in parts[1:])


@pytest.mark.parametrize(
    ("text", "settings"),
    [
        (TURNED + FLOOR + BALL, {}),
        (SUN + FLOOR.replace("(3, 3, 0)", "(3, -9, 0)") + BALL, {"shadows": True}),
        (SUN + BULB + FLOOR + BALL, {"samples": 2, "motion_blur": True, "layers": ("beauty",)}),
        (SUN + BULB + FLOOR + BALL, {"layers": ("beauty", "cryptoObject")}),
        (SUN + BULB + FLOOR + BALL, {"samples": 2, "max_error": 0.5}),
        (DOME + FLOOR + BALL, {"samples": 2}),
    ],
)
def test_what_shows_anywhere_is_drawn_whole(
    text: str, settings: dict[str, Any], tmp_path: Path, renderer: Renderer
) -> None:
    job = job_of(text, tmp_path, (1.0, 2.0), {"size": (64, 48), "light_points": 1} | settings)
    assert drawn(job, renderer)[1] == ["all", "all"]


def test_nothing_after_nothing_is_nothing_to_draw() -> None:
    settings = RenderSettings(size=(16, 9), shadows=False)
    empty, again = (scene([], [sun()], drawables=[]) for _ in range(2))
    first, second = (replace(each, lights=empty.lights) for each in (empty, again))
    planned = make_plan(first, settings)
    redrawing = plan_after(first, planned, second, make_plan(second, settings)).redrawing
    assert (redrawing.reason, redrawing.moved) == ("", 0)
