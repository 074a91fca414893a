"""What a reader of the documents has in their folder, small: stages with all that the pages' examples speak of."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

_CAR = """def Xform "Car" (
    variants = {
        string color = "blue"
        string wheels = "summer"
    }
    prepend variantSets = ["color", "wheels"]
) {
    def Cube "Body" {
        double size = 1
    }
    variantSet "color" = {
        "red" {
        }
        "blue" {
        }
    }
    variantSet "wheels" = {
        "winter" {
        }
        "summer" {
        }
    }
}
"""

_CAMERA = """def Camera "%s" {
    double3 xformOp:translate = (%g, 0, 6)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""

_LIGHT = """def SphereLight "%s" {
    float inputs:intensity = 60
    token inputs:lightGroup = "%s"
    double3 xformOp:translate = (%g, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""

_SETTINGS = """def Scope "Render" {
    def RenderSettings "settings" {
        int2 resolution = (64, 36)
    }
}
"""

_HEADER = '#usda 1.0\n(\n    upAxis = "Y"\n    metersPerUnit = 1\n    renderSettingsPrimPath = "/Render/settings"\n)\n'

_OCIO = """ocio_profile_version: 2
roles: {default: ACEScg, scene_linear: ACEScg}
file_rules: [!<Rule> {name: Default, colorspace: default}]
displays:
  sRGB - Display: [!<View> {name: Film, colorspace: Video}]
colorspaces:
  - !<ColorSpace> {name: ACEScg, encoding: scene-linear}
  - !<ColorSpace> {name: lin_rec709, encoding: scene-linear, to_scene_reference: !<MatrixTransform> {matrix:
      [0.6131, 0.3395, 0.0474, 0, 0.0702, 0.9164, 0.0134, 0, 0.0206, 0.1096, 0.8698, 0, 0, 0, 0, 1]}}
  - !<ColorSpace> {name: Video, from_scene_reference: !<ExponentTransform> {value: 2.2, direction: inverse}}
"""

PICTURES = """
defshade render shot.usd -o before.exr -o before.png
defshade render asset.usd --fit --studio --size 32x32 --samples 1 -o reference.png
defshade render shot.usd --layers beauty,depth,normal -o shot.exr
for copy in after truth noisy reference; do cp before.exr $copy.exr; done
cp before.png after.png
"""
"""Commands that make the images that the pages compare."""


JOB_FILE = "nightly.yaml"
"""What the pages call a job file."""


def furnish(folder: Path) -> None:
    """Write all of it into an empty folder, but for the images."""
    asset, shot = _HEADER + _CAR, "".join(_shot())
    for name in ("asset", "teapot", "chair", "assets/vase", "assets/chair"):
        _write(folder / f"{name}.usd", asset)
    for name in ("shot.usd", "shot.usda", "scene.usda", "stage.usd", "car.usd", "scenes/showcase.usda"):
        _write(folder / name, shot)
    for name in ("shots/sh010.usda", "shots/sh020.usda", "shots/sh010.usd"):
        _write(folder / name, shot)
    _write(folder / "review.usda", "#usda 1.0\n" + _LIGHT % ("Torch", "torch", -1))
    _write(folder / "show.ocio", _OCIO)
    _write(folder / JOB_FILE, "stages: [shots/*.usda]\nframes: 1:2\noutputs: ['nightly/{scene}.####.exr']\n")


def _shot() -> Iterator[str]:
    yield _HEADER + _CAR + _SETTINGS
    yield 'def Xform "World" {\n' + _CAR
    yield 'def Scope "Lights" {\n' + _LIGHT % ("Key", "Key", 2) + _LIGHT % ("Fill", "key", -2) + "}\n"
    yield 'def Scope "cams" {\n' + _CAMERA % ("main", 0) + "}\n}\n"
    yield (
        'def Scope "cams" {\n'
        + "".join(_CAMERA % camera for camera in (("main", 0), ("left", -1), ("right", 1)))
        + "}\n"
    )


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
