"""Our floors against Arnold's, on luxtest's sweeps of rect and sphere lights: unshadowed points, as a table.

`python -m defshade_cli.measure.luxtest ASSETS docs/lighting.md` writes the table anew. The references are path traced
with one bounce, 160 x 120, 8 bits; means over blocks of 5 x 5 pixels are compared where the floor is neither shaded by
the blocker nor black nor white. Arnold's floor is Lambertian; ours is the roughest UsdPreviewSurface, whose departure
from Lambert's law towards the light's centre is divided out.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.reading import read
from defshade_cli.image.transfer import linear
from defshade_cli.measure.brdf import evaluate_brdf
from defshade_cli.measure.reference import surface_from_planes
from defshade_cli.measure.sections import replace_generated
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings
from defshade_cli.spaces import normalize
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.reader import StageReader

ITEMS = ("arnold_lux_sphere", "arnold_lux_rect")
SIZE = (160, 120)
SAMPLES = 64

_BLOCK = 5
_SHADED = 0.03  # change by shadows from which on a pixel counts as shaded
_DARKEST, _BRIGHTEST = 0.03, 0.97  # of what 8 bits tell apart
ACESCG_RED = np.array([1.70505, -0.13026, -0.02400])
"""Linear Rec. 709 of ACEScg's red: Arnold reads the tint, (1, 0, 0), in its rendering space, which is ACEScg."""

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Sweep:
    """One frame of a sweep and Arnold's picture of it."""

    stage: Path
    picture: Path
    frame: float


@dataclass(frozen=True, slots=True, eq=False)
class Agreement:
    """ratios: (B,) ours over Arnold's, of the blocks' brightest channel.

    even: (B,) whose neighbours' brightness spreads over less than their own.
    """

    light: str
    shaping: str
    ratios: Array
    even: NDArray[np.bool_]

    @property
    def median(self) -> float:
        """The middle one of the ratios."""
        return float(np.median(self.ratios))

    @property
    def within(self) -> float:
        """Share of blocks within 3 %."""
        return float(self._agree.mean())

    @property
    def within_even(self) -> str:
        """Of the even blocks, how many are within 3 %."""
        return f"{self._agree[self.even].sum()} of {self.even.sum()}"

    @property
    def _agree(self) -> NDArray[np.bool_]:
        return np.abs(self.ratios - 1.0) <= 0.03


def sweeps(assets: Path) -> Iterator[Sweep]:
    """Those that have a picture, as their ITEM.json lists them."""
    for item in ITEMS:
        for scene in json.loads((assets / item / "ITEM.json").read_text("utf-8"))["scenes"]:
            for reference in scene["references"]:
                frame = re.search(r"-frame (\d+)", reference["command"])
                assert frame, reference["command"]
                yield Sweep(assets / item / scene["scene"], assets / item / reference["image"], float(frame[1]))


def agreement(pipeline: Pipeline, sweep: Sweep, samples: int = SAMPLES) -> Agreement:
    """Render a sweep's frame and compare its floor. Raises the errors of errors.py."""
    scene = _rough(StageReader(open_stage(sweep.stage)).read(sweep.frame))
    settings = RenderSettings(size=SIZE, samples=samples, shadows=False)
    lit, planes = _beauty(pipeline, scene, settings), pipeline.planes(scene, make_plan(scene, settings))
    shaded = _beauty(pipeline, scene, replace(settings, samples=max(samples // 8, 2), shadows=True))
    unshaded = _beauty(pipeline, scene, replace(settings, samples=max(samples // 8, 2)))
    free = np.abs(shaded - unshaded).max(axis=-1) <= _SHADED * unshaded.max(axis=-1) + 1e-6
    floor, lambertian = _floor(planes, scene)
    ours, arnold = _blocks(_tinted(lit / lambertian[..., None], scene)), _blocks(_linear(sweep.picture))
    whole = _blocks((free & floor).astype(np.float64)[..., None])[..., 0] > 0.999
    bright = arnold.max(axis=-1)
    compared = whole & (bright > _DARKEST) & (bright < _BRIGHTEST)
    channel = arnold[compared].argmax(axis=-1)[:, None]
    ratios = np.take_along_axis(ours[compared], channel, 1) / np.take_along_axis(arnold[compared], channel, 1)
    return Agreement(scene.lights[0].kind, _shaping(scene), ratios[:, 0], _are_even(ours.max(axis=-1))[compared])


def _rough(scene: Scene) -> Scene:
    """With Arnold's framing: the width of the view is kept."""
    materials = tuple(replace(material, roughness=1.0) for material in scene.materials)
    return replace(scene, conform="adjustApertureHeight", materials=materials)


def _beauty(pipeline: Pipeline, scene: Scene, settings: RenderSettings) -> Array:
    return pipeline.render(scene, make_plan(scene, settings)).layers["beauty"][..., :3].astype(np.float64)


def _floor(planes: dict[str, NDArray[np.float32]], scene: Scene) -> tuple[NDArray[np.bool_], Array]:
    """(H, W) where the floor is, and there our reflection towards the light's centre over Lambert's; 1 elsewhere."""
    camera = make_plan(scene, RenderSettings(size=SIZE)).camera
    surface, covered = surface_from_planes(planes, camera)
    on_floor = np.abs(surface.position[:, 1]) < 1e-3
    to_light = normalize(scene.lights[0].position - surface.position)
    facing = np.maximum(np.einsum("pi,pi->p", surface.normal, to_light), 1e-3)
    reflected = evaluate_brdf(surface, to_light, shading="preview-surface")[:, 0] * np.pi / facing
    floor, ratio = np.zeros(covered.shape, bool), np.ones(covered.shape)
    floor[covered] = on_floor
    ratio[covered] = np.where(on_floor & (reflected > 0.5), reflected, 1.0)
    return floor, ratio


def _tinted(image: Array, scene: Scene) -> Array:
    """What a red tint adds to the red, in the colour that Arnold gives it."""
    shaping = scene.lights[0].shaping
    if shaping is None or shaping.focus_tint != (1.0, 0.0, 0.0):
        return image
    return image[..., 1:2] + (image[..., :1] - image[..., 1:2]) * ACESCG_RED


def _linear(picture: Path) -> Array:
    """(H, W, 3) of 8 bits sRGB-encoded."""
    return linear(next(iter(read(picture).values()))[..., :3].astype(np.float64))


def _blocks(image: Array) -> Array:
    height, width, channels = image.shape
    return image.reshape(height // _BLOCK, _BLOCK, width // _BLOCK, _BLOCK, channels).mean(axis=(1, 3))


def _are_even(brightness: Array) -> NDArray[np.bool_]:
    """(h, w) blocks beside which nothing changes fast: no rim of a cone, no foot of a light."""
    around = sliding_window_view(np.pad(brightness, 1, mode="edge"), (3, 3))
    return around.max(axis=(2, 3)) - around.min(axis=(2, 3)) < brightness


def _shaping(scene: Scene) -> str:
    shaping = scene.lights[0].shaping
    assert shaping
    if shaping.ies:
        return "IES profile, normalised"
    cone = f"cone {shaping.cone_angle:g}°, softness {shaping.cone_softness:g}" if shaping.cone_angle < 180.0 else ""
    focus = f"focus {shaping.focus:g}" + (", red tint" if any(shaping.focus_tint) else "") if shaping.focus else ""
    return "; ".join(filter(None, [focus, cone]))


def table(results: list[Agreement]) -> str:
    """Markdown: one row a sweep."""
    rows = [
        f"| {r.light} | {r.shaping} | {len(r.ratios)} | {r.median:.3f} | {r.within:.0%} | {r.within_even} |"
        f" {np.percentile(r.ratios, 5):.3f} … {np.percentile(r.ratios, 95):.3f} |"
        for r in results
    ]
    head = "| light | shaping | blocks | median of ours / Arnold's | within 3 % | even floor | 5th … 95th percentile |"
    return "\n".join([head, "|---|---|---:|---:|---:|---:|---|", *rows])


def main(assets: Path, page: Path) -> None:
    """Measure luxtest's sweeps, and write the table into the page."""
    with Gpu() as gpu:
        pipeline = Pipeline(gpu)
        results = [agreement(pipeline, sweep, samples=256) for sweep in sweeps(assets)]
    page.write_text(replace_generated(page.read_text("utf-8"), "luxtest", table(results)), "utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
