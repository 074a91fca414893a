"""What the assets folder holds: its ITEM.json files as Cases, one a reference image and one a stage without any."""

from __future__ import annotations

import json
import os
import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import UsageError
from defshade_cli.settings import Complexity
from defshade_cli.spaces import ConformPolicy

Maker = Literal["storm", "usdrecord", "arnold", "viewer", "none"]
"""Who made a reference: OpenUSD's drawing test, usdrecord, Arnold's kick, some viewer under conditions unknown."""

Lighting = Literal["stage", "unlit", "distant"]
"""The stage's own lights; none, colours as they are; one white distant light beside the stage's own."""

Options = Mapping[str, Sequence[Sequence[str]]]
Rectangle = tuple[float, float, float, float]

_COMPLEXITIES: dict[float, Complexity] = {1.0: "low", 1.1: "medium", 1.2: "high", 1.3: "veryhigh"}


@dataclass(frozen=True, slots=True)
class Conditions:
    """How a reference was made.

    size: (width, height) in pixels; None takes the reference image's.
    frame: time code; None is the default time, "first" the stage's first frame.
    camera: prim path; None and no `translate`: the rule of usd/camera.py.
    translate: what the drawing test moves the stage by, which it has turned so that Y is up, where it names no camera;
        "frame" moves the stage's box into view.
    conform: how the camera's window is fitted to the image, where the stage does not say so.
    crop: (left, top, right, bottom), the part of that camera's image that is shown, each 0..1.
    clip_planes: (a, b, c, d) each, in camera space, as UsdGeomCamera has them.
    camera_light: the distant light stands where the drawing test puts one for `-camlight`.
    background: scene-linear, opaque; None is transparent black.
    bare: the albedo that the renderer gives to what has neither material nor displayColor; None for our own.
    """

    size: tuple[int, int] | None = None
    frame: float | Literal["first"] | None = "first"
    camera: str | None = None
    translate: tuple[float, float, float] | Literal["frame"] | None = None
    conform: ConformPolicy | None = None
    crop: Rectangle = (0.0, 0.0, 1.0, 1.0)
    clip_planes: tuple[Rectangle, ...] = ()
    complexity: Complexity = "auto"
    purposes: tuple[str, ...] = ("default", "render")
    lighting: Lighting = "stage"
    camera_light: bool = False
    background: tuple[float, float, float] | None = None
    bare: float | None = None


@dataclass(frozen=True, slots=True)
class Case:
    """One picture to make.

    key: unique, fit for a file name.  stage_name: the stage's path below its item.
    image: the reference, None where there is none.
    """

    key: str
    item: str
    stage: Path
    stage_name: str
    image: Path | None
    maker: Maker
    conditions: Conditions


def assets_folder() -> Path:
    """$DEFSHADE_ASSETS, else ../shared/assets. Raises UsageError where that is no folder."""
    folder = Path(os.environ.get("DEFSHADE_ASSETS", "../shared/assets"))
    if not folder.is_dir():
        raise UsageError(f"no stages by others at {folder}: let DEFSHADE_ASSETS name the folder with their ITEM.json")
    return folder


def read_items(folder: Path) -> dict[str, tuple[Case, ...]]:
    """Item name → its cases, in the order of its ITEM.json."""
    return {path.parent.name: read_item(path.parent) for path in sorted(folder.glob("*/ITEM.json"))}


def read_item(item: Path) -> tuple[Case, ...]:
    """One for each reference of each stage of an item's folder, and one for each stage without any."""
    scenes = json.loads((item / "ITEM.json").read_text("utf-8"))["scenes"]
    pairs = [(scene["scene"], reference) for scene in scenes for reference in scene["references"] or [{}]]
    return tuple(_case(f"{item.name}-{n:02}", item, *pair) for n, pair in enumerate(pairs))


def _case(key: str, item: Path, name: str, reference: Mapping[str, Any]) -> Case:
    stage = item / name
    if not reference:
        return Case(key, item.name, stage, name, None, "none", Conditions(size=(640, 480)))
    command = reference.get("command", "")
    maker = _maker(reference, command)
    conditions = {"storm": _storm, "usdrecord": _usdrecord, "arnold": _arnold}.get(maker, _viewer)
    if maker == "arnold":
        command += _readme_options(item / name)
    return Case(key, item.name, stage, name, item / reference["image"], maker, conditions(reference, command))


def _maker(reference: Mapping[str, Any], command: str) -> Maker:
    if "background_linear" in reference:
        return "storm"
    if command.startswith("kick"):
        return "arnold"
    # "usdrecord" makes the frames of an animation too, which the catalogue calls "same"
    return "usdrecord" if "usdrecord" in command or command == "same" else "viewer"


def _storm(reference: Mapping[str, Any], command: str) -> Conditions:
    """testUsdImagingGLBasicDrawing: REFERENCES.md beside the items describes it."""
    options = _options(command)
    time = reference["time"]
    return Conditions(
        size=tuple(reference["resolution"]),
        frame=time if isinstance(time, float) else None,
        camera=reference.get("camera"),
        translate=None if "camera" in options else _translate(options),
        conform="adjustApertureWidth",
        crop=_crop(options),
        clip_planes=tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in options.get("clipPlane", ())),
        complexity=_COMPLEXITIES[_complexity(reference, options)],
        purposes=_purposes(options),
        lighting=_lighting(options),
        camera_light="camlight" in options,
        background=tuple(reference["background_linear"][:3]),
        bare=0.5,
    )


def _complexity(reference: Mapping[str, Any], options: Options) -> float:
    """With `-complexities` the image is named after its own."""
    if "complexities" in options:
        return float(Path(reference["image"]).stem.rpartition("_")[2])
    return float(reference.get("complexity", 1.0))


def _lighting(options: Options) -> Lighting:
    if "lighting" not in options:
        return "unlit"
    return "stage" if "sceneLights" in options else "distant"


def _translate(options: Options) -> tuple[float, float, float] | Literal["frame"]:
    if "frameAll" in options:
        return "frame"
    x, y, z = map(float, options["translate"][0]) if "translate" in options else (0.0, -1000.0, -2500.0)
    return x, y, z


def _purposes(options: Options) -> tuple[str, ...]:
    shown = {"guide": "guidesPurpose" in options, "render": "renderPurpose" in options, "proxy": True}
    for purpose, name in (("guide", "guidesPurpose"), ("render", "renderPurpose"), ("proxy", "proxyPurpose")):
        if name in options:
            shown[purpose] = options[name][0] == ["show"]
    return ("default", *(purpose for purpose, is_shown in shown.items() if is_shown))


def _crop(options: Options) -> Rectangle:
    """The camera fills the display window, of which the image shows the data window."""
    if "displayWindow" not in options:
        return (0.0, 0.0, 1.0, 1.0)
    x, y, width, height = map(float, options["displayWindow"][0])
    left, top, right, bottom = map(float, options["dataWindow"][0])
    return (left - x) / width, (top - y) / height, (right + 1 - x) / width, (bottom + 1 - y) / height


def _usdrecord(reference: Mapping[str, Any], command: str) -> Conditions:
    """Frames are in the image's name. The first is the default, and `purposes` is the program's own choice."""
    frame = Path(reference["image"]).suffixes[0][1:]
    time: float | Literal["first"] = float(frame) if frame.isdigit() else "first"
    return Conditions(frame=time, complexity="low", purposes=("default", "proxy"))


def _arnold(reference: Mapping[str, Any], command: str) -> Conditions:
    """kick's later options win; without a frame it renders frame 1, and `-sm lambert` has what is bare white."""
    options = _options(command)
    width, height = options["r"][-1]
    frame = float(options["frame"][-1][0]) if "frame" in options else 1.0
    return Conditions(size=(int(width), int(height)), frame=frame, conform="adjustApertureHeight", bare=1.0)


def _readme_options(stage: Path) -> str:
    """The frame that a test of Arnold's asks for in its README, where it has a script of its own."""
    readme = stage.parents[1] / "README"
    found = re.search(r"'script':'[^']*(-frame [0-9.]+)", readme.read_text("utf-8")) if readme.exists() else None
    return f" {found[1]}" if found else ""


def _viewer(reference: Mapping[str, Any], command: str) -> Conditions:
    return Conditions(purposes=("default", "proxy") if "proxy" in reference["image"] else ("default", "render"))


def _options(command: str) -> dict[str, list[list[str]]]:
    """`-name value …` → name → the values of each time it stands there. A number is a value, its sign no dash."""
    options: dict[str, list[list[str]]] = {}
    values: list[str] = []
    for word in shlex.split(command):
        if word.startswith("-") and not word[1:2].isdigit():
            values = []
            options.setdefault(word[1:], []).append(values)
        else:
            values.append(word)
    return options
