"""A Case → our picture beside the reference, what differs between them, and the numbers."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.image.film import Film
from defshade_cli.image.reading import read
from defshade_cli.measure.conformance.arnold import read_as_arnold, samples_of
from defshade_cli.measure.conformance.catalogue import Case
from defshade_cli.measure.conformance.conditions import under, with_bare
from defshade_cli.measure.conformance.silhouette import (
    ANY_SAMPLE,
    HALF,
    Mask,
    Noise,
    even_background,
    intersection_over_union,
    mask_of_alpha,
    mask_of_color,
    noise_of,
)
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan, plan_moments
from defshade_cli.scene.camera import Camera
from defshade_cli.scene.framing import Held
from defshade_cli.scene.scene import Scene
from defshade_cli.settings import RenderSettings
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.options import ReadOptions
from defshade_cli.usd.reader import StageReader
from defshade_cli.usd.surfaces.extent import stage_extent

Picture = NDArray[np.float32]
Places = tuple[tuple[float, float], ...]

SAMPLES = {"arnold": 64, "viewer": 4, "none": 4}
OPACITY_SAMPLES = 64
"""At each of Storm's places, so that the mean of coins is an opacity."""
_NARROWEST = 1e-3  # pixels

MULTISAMPLE: Places = ((0.375, 0.875), (0.875, 0.625), (0.125, 0.375), (0.625, 0.125))
"""Where OpenGL takes the four samples of a pixel, from its upper left corner: Direct3D's places upside down."""
_CENTRE: Places = ((0.5, 0.5),)

_LARGEST = 640  # pixels across, of pictures that are only looked at
_BACKDROP = (0.2, 0.2, 0.2)
_OURS_ALONE, _THEIRS_ALONE = (1.0, 0.45, 0.0), (0.0, 0.7, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """pictures: "ours", and where there are any "reference" and "difference" → (H, W, 3) in [0, 1], display-ready.

    iou, rmse, unsupported, seconds: as in Result.  noise: of the reference, where it is one of random samples.
    """

    pictures: dict[str, Picture]
    unsupported: tuple[str, ...]
    seconds: dict[str, float]
    iou: float | None = None
    rmse: float | None = None
    noise: Noise | None = None


def draw(case: Case, pipeline: Pipeline) -> Drawn:
    """Raises the errors of errors.py."""
    reference = read(case.image)["beauty"] if case.image else None
    start = time.perf_counter()
    size = _size(case, reference)
    stage = _stage(case)
    reader = StageReader(stage, _options(case, size))
    scene = _scene(case, stage, reader, size)
    read_at = time.perf_counter()
    settings = RenderSettings(size=size, shadows=case.maker != "storm", background=_shows_sky(case, reference))
    pixels, alpha = _render(case, pipeline, scene, reader, settings)
    seconds = {"read": read_at - start, "draw": time.perf_counter() - read_at}
    unsupported = tuple(f"{issue.path}: {issue.reason}" for issue in scene.unsupported)
    drawn = Drawn({"ours": _shown(case, pixels)}, unsupported, seconds)
    if reference is None:
        return drawn
    noise = noise_of(alpha, samples_of(stage), HALF) if case.maker == "arnold" else None
    return replace(_compared(case, drawn, alpha, reference), noise=noise)


def _compared(case: Case, drawn: Drawn, alpha: Picture, reference: Picture) -> Drawn:
    """With the reference, and with what its maker's conditions allow to be measured."""
    ours, theirs = drawn.pictures["ours"], _reference_shown(case, reference)
    drawn = replace(
        drawn,
        pictures={"ours": ours, "reference": theirs},
        rmse=float(np.sqrt(np.mean((ours - theirs) ** 2))) if case.maker in ("storm", "arnold") else None,
    )
    masks = None if case.maker == "viewer" else _masks(case, alpha, reference)
    if masks is None:
        return drawn
    difference = _difference(ours, theirs, *masks)
    return replace(drawn, pictures=drawn.pictures | {"difference": difference}, iou=intersection_over_union(*masks))


def _stage(case: Case) -> Any:
    """Usd.Stage, as the reference's maker understands it."""
    stage = open_stage(case.stage)
    if case.maker == "arnold":
        read_as_arnold(stage)
    return stage


def _options(case: Case, size: tuple[int, int]) -> ReadOptions:
    conditions = case.conditions
    return ReadOptions(
        camera=conditions.camera, purposes=conditions.purposes, complexity=conditions.complexity, size=size
    )


def _scene(case: Case, stage: Any, reader: StageReader, size: tuple[int, int]) -> Scene:
    """With the reference's camera, and what faces it."""
    conditions = case.conditions
    frame = reader.first_frame() if conditions.frame == "first" else conditions.frame
    scene = under(conditions, reader.read(frame), stage_extent(stage, conditions.purposes))
    if conditions.background is None:
        return with_bare(conditions, scene)
    held = replace(_options(case, size), camera=None, framing=Held(scene.camera))
    seen = StageReader(stage, held, beside=reader).read(frame)
    return with_bare(conditions, replace(scene, meshes=seen.meshes, drawables=seen.drawables))


def _size(case: Case, reference: Picture | None) -> tuple[int, int]:
    if case.conditions.size or reference is None:
        return case.conditions.size or (_LARGEST, 480)
    height, width = reference.shape[:2]
    scale = min(1.0, _LARGEST / width) if case.maker == "viewer" else 1.0
    return round(width * scale), round(height * scale)


def _shows_sky(case: Case, reference: Picture | None) -> bool:
    """Whether the reference does: Storm's drawing test may be asked not to, Arnold has a primvar that hides domes."""
    background = case.conditions.background
    if reference is None or not (background or case.maker == "arnold"):
        return True
    corners = reference[[0, 0, -1, -1], [0, -1, 0, -1]]
    return bool(mask_of_color(corners[:, :3], background).any() if background else (corners[:, 3] > HALF).any())


def _render(
    case: Case, pipeline: Pipeline, scene: Scene, reader: StageReader, settings: RenderSettings
) -> tuple[Picture, Picture]:
    """(H, W, 4) scene-linear, premultiplied, and (H, W) what geometry covers; where Storm drew, by its samples."""
    if case.maker not in ("storm", "usdrecord"):
        pixels = _filtered(case, pipeline, scene, reader, replace(settings, samples=SAMPLES[case.maker]))
        return pixels, pixels[..., 3]
    unlit = case.conditions.lighting == "unlit"
    settings = replace(settings, layers=("depth", "albedo" if unlit else "beauty"))
    cutout = make_plan(scene, settings).cutout
    coins = replace(settings, layers=("alpha",), samples=OPACITY_SAMPLES, filter_width=_NARROWEST, background=False)
    places = _CENTRE if cutout and _blends(pipeline, scene, coins) else MULTISAMPLE
    films = list(_taken(pipeline, scene, settings, places))
    pixels = np.mean([_pixels(film) for film in films], axis=0)
    covered = (
        [film.layers["alpha"][..., 0] for film in _taken(pipeline, scene, coins, places)]
        if cutout
        else [np.isfinite(film.layers["depth"][..., 0]) for film in films]
    )
    return pixels, np.mean(covered, axis=0)


def _blends(pipeline: Pipeline, scene: Scene, coins: RenderSettings) -> bool:
    """Whether anything is seen through: Storm switches multisampling off while it blends, we for all of the picture."""
    (film,) = _taken(pipeline, scene, coins, _CENTRE)
    alpha = film.layers["alpha"]
    return bool(((alpha > 0.0) & (alpha < 1.0)).any())


def _filtered(case: Case, pipeline: Pipeline, scene: Scene, reader: StageReader, settings: RenderSettings) -> Picture:
    """The beauty as the program renders it, while the shutter is open."""
    plan = make_plan(scene, settings)
    moments = (with_bare(case.conditions, moment) for moment in reader.read_shutter(scene, plan.moments))
    return pipeline.render(scene, plan, plan_moments(plan, moments, settings)).layers["beauty"]


def _taken(pipeline: Pipeline, scene: Scene, settings: RenderSettings, places: Places) -> Iterator[Film]:
    """A film for each place in the pixel."""
    plan = make_plan(scene, settings)
    for place in places:
        moved = replace(scene, camera=_moved(plan.camera, plan.size, place))
        yield pipeline.render(moved, make_plan(moved, settings))


def _moved(camera: Camera, size: tuple[int, int], place: tuple[float, float]) -> Camera:
    """Every pixel's centre moved to a place in the pixel."""
    left, right, bottom, top = camera.window
    dx, dy = (place[0] - 0.5) * (right - left) / size[0], (0.5 - place[1]) * (top - bottom) / size[1]
    return replace(camera, window=(left + dx, right + dx, bottom + dy, top + dy))


def _pixels(film: Film) -> Picture:
    """The beauty, or without one the colours as they are, premultiplied by coverage."""
    if "beauty" in film.layers:
        return film.layers["beauty"]
    covered = np.isfinite(film.layers["depth"]).astype(np.float32)
    return np.concatenate([film.layers["albedo"] * covered, covered], axis=-1)


def _shown(case: Case, pixels: Picture) -> Picture:
    """As the reference is encoded: Storm's drawing test writes linear light, all others sRGB."""
    if case.conditions.background is not None:
        return _quantised(_over(pixels, case.conditions.background))
    if case.maker == "arnold":
        return _quantised(_srgb(pixels[..., :3]))
    return _quantised(_srgb(_over(pixels, _BACKDROP)))


def _reference_shown(case: Case, reference: Picture) -> Picture:
    rgb = reference[..., :3]
    if case.conditions.background is not None or case.maker == "arnold" or reference.shape[-1] < 4:
        return rgb
    return rgb * reference[..., 3:] + _srgb(np.array(_BACKDROP)) * (1.0 - reference[..., 3:])


def _masks(case: Case, alpha: Picture, reference: Picture) -> tuple[Mask, Mask] | None:
    """Our silhouette and the reference's; None where the reference has none to read off."""
    threshold = HALF if case.maker == "arnold" else ANY_SAMPLE
    ours = mask_of_alpha(alpha, threshold)
    if case.maker != "storm":
        return ours, mask_of_alpha(reference[..., 3], threshold)
    background = even_background(reference[..., :3])
    return None if background is None else (ours, mask_of_color(reference[..., :3], background))


def _difference(ours: Picture, theirs: Picture, mask: Mask, their_mask: Mask) -> Picture:
    """Four times as bright as it is, under the pixels that are in one silhouette alone."""
    shown = np.clip(4.0 * np.abs(ours - theirs), 0.0, 1.0) * 0.6
    shown[mask & ~their_mask] = _OURS_ALONE
    shown[their_mask & ~mask] = _THEIRS_ALONE
    return shown.astype(np.float32)


def _over(rgba: Picture, background: tuple[float, float, float]) -> Picture:
    return rgba[..., :3] + (1.0 - rgba[..., 3:]) * np.array(background, np.float32)


def _srgb(linear: NDArray[Any]) -> Picture:
    """IEC 61966-2-1."""
    x = np.clip(np.nan_to_num(linear), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055).astype(np.float32)


def _quantised(pixels: Picture) -> Picture:
    """Clamped to 8 bits as Storm does it: floor(255 v + 0.499999)."""
    return (np.floor(255.0 * np.clip(pixels, 0.0, 1.0) + 0.499999) / 255.0).astype(np.float32)
