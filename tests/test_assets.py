"""Every stage by others renders, or ends with one sentence that names what is wrong; the pictures go on a sheet."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from defshade_cli.errors import DefshadeError, EmptyStage
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.colour import display_transform
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.plan import make_plan
from defshade_cli.settings import RenderSettings
from defshade_cli.usd.opening.stage import open_stage
from defshade_cli.usd.reader import StageReader

ROOT = Path(__file__).resolve().parent.parent
SHEET = ROOT / "build" / "assets.png"
TILE = (128, 96)
COLUMNS = 14


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one stage: a picture, or the sentence it ended with."""

    stage: str
    picture: NDArray[np.float32] | None
    sentence: str = ""


def stages(assets: Path) -> list[Path]:
    """The scenes that each folder's ITEM.json lists."""
    items = sorted(assets.glob("*/ITEM.json"))
    return [item.parent / scene["scene"] for item in items for scene in json.loads(item.read_text())["scenes"]]


def render(path: Path, pipeline: Pipeline) -> Outcome:
    try:
        reader = StageReader(open_stage(path))
        scene = reader.read(reader.first_frame())
        film = pipeline.render(scene, make_plan(scene, RenderSettings(size=TILE)))
    except DefshadeError as error:
        return Outcome(path.stem, None, str(error))
    return Outcome(path.stem, film.layers["beauty"])


@pytest.fixture(scope="module")
def outcomes(assets: Path, gpu: Gpu) -> Iterator[list[Outcome]]:
    pipeline = Pipeline(gpu)
    found = [render(path, pipeline) for path in stages(assets)]
    _write_sheet([outcome.picture for outcome in found if outcome.picture is not None])
    yield found


def _write_sheet(pictures: list[NDArray[np.float32]]) -> None:
    width, height = TILE
    rows = -(-len(pictures) // COLUMNS)
    sheet = np.zeros((rows * height, COLUMNS * width, 4), np.float32)
    for i, picture in enumerate(pictures):
        y, x = divmod(i, COLUMNS)
        sheet[y * height : (y + 1) * height, x * width : (x + 1) * width] = picture
    SHEET.parent.mkdir(exist_ok=True)
    image = oiio.ImageBuf(np.ascontiguousarray(display_transform().apply(sheet)[..., :3]))
    assert image.write(str(SHEET), "uint8"), image.geterror()


def test_nearly_all_of_them_are_pictures(outcomes: list[Outcome]) -> None:
    """What does not render has no geometry of a supported kind, and says so in one line that names the stage."""
    for outcome in outcomes:
        if outcome.picture is None:
            assert "\n" not in outcome.sentence and outcome.stage in outcome.sentence
    assert sum(outcome.picture is not None for outcome in outcomes) >= 0.85 * len(outcomes)


def test_no_picture_holds_a_number_that_is_none(outcomes: list[Outcome]) -> None:
    bad = [o.stage for o in outcomes if o.picture is not None and not np.isfinite(o.picture).all()]
    assert bad == []


def test_a_stage_without_geometry_says_so(tmp_path: Path) -> None:
    stage = tmp_path / "void.usda"
    stage.write_text('#usda 1.0\ndef Scope "Nothing" {}\n')
    with pytest.raises(EmptyStage, match=r"void\.usda"):
        StageReader(open_stage(stage)).read(None)
