"""Stages by others beside their references: what is compared, how, and that silhouettes agree."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra.numpy import arrays

from browser import needs_browser, told_by
from defshade_cli.errors import UsageError
from defshade_cli.gpu.context import Gpu
from defshade_cli.image.snapshot import write_snapshot
from defshade_cli.measure.conformance import batch
from defshade_cli.measure.conformance.arnold import read_as_arnold, samples_of
from defshade_cli.measure.conformance.catalogue import assets_folder, read_item
from defshade_cli.measure.conformance.conditions import under, with_bare
from defshade_cli.measure.conformance.drawing import draw
from defshade_cli.measure.conformance.page import page_of
from defshade_cli.measure.conformance.remarks import remark_on
from defshade_cli.measure.conformance.report import report_of, summary_of, tables_of
from defshade_cli.measure.conformance.results import LEAST_IOU, Result
from defshade_cli.measure.conformance.silhouette import (
    Noise,
    even_background,
    intersection_over_union,
    mask_of_color,
    noise_of,
)
from defshade_cli.passes.pipeline import Pipeline
from defshade_cli.usd.reader import StageReader
from stages import stage_of

STORM = {
    "image": "reference/cube_1.3.png",
    "resolution": [640, 480],
    "background_linear": [1.0, 0.5, 0.1, 1.0],
    "time": "UsdTimeCode.Default()",
    "command": "test -frameAll -complexities 1.0 1.3 -lighting -camlight -renderPurpose show -proxyPurpose hide "
    "-clipPlane -1 0 0 0.5 -dataWindow 0 0 639 479 -displayWindow -320 -240 1280 960 -stage cube.usda",
}
CUBE = '#usda 1.0\n(\n    upAxis = "Z"\n)\ndef Cube "cube" {\n}\n'
masks = arrays(bool, (4, 5))


def item(folder: Path, *references: dict, stage: str = CUBE) -> Path:
    """An item with one stage and these references."""
    (folder / "cube.usda").write_text(stage)
    (folder / "ITEM.json").write_text(json.dumps({"scenes": [{"scene": "cube.usda", "references": references}]}))
    return folder


# What is compared


def test_the_drawing_tests_command_is_understood(tmp_path: Path) -> None:
    (case,) = read_item(item(tmp_path, STORM))
    conditions = case.conditions
    assert (case.maker, conditions.frame, conditions.complexity) == ("storm", None, "veryhigh")
    assert conditions.purposes == ("default", "render") and conditions.lighting == "distant"
    assert conditions.translate == "frame" and conditions.camera_light
    assert conditions.clip_planes == ((-1.0, 0.0, 0.0, 0.5),)
    assert conditions.crop == (0.25, 0.25, 0.75, 0.75)


def test_each_makers_conditions_are_its_own(tmp_path: Path) -> None:
    kick = {"image": "reference/a.tif", "command": "kick cube.usda -r 160 120 -sl -frame 27 -r 160 90"}
    record = {"image": "reference/a.5.png", "command": "usdrecord cube.usda"}
    unknown = {"image": "reference/a_proxy.png"}
    arnold, usdrecord, viewer = read_item(item(tmp_path, kick, record, unknown))
    assert (arnold.maker, arnold.conditions.size, arnold.conditions.frame) == ("arnold", (160, 90), 27.0)
    assert (usdrecord.maker, usdrecord.conditions.frame, usdrecord.conditions.complexity) == ("usdrecord", 5.0, "low")
    assert (viewer.maker, viewer.conditions.purposes) == ("viewer", ("default", "proxy"))


def test_arnold_hides_geometry_from_the_camera_and_keeps_the_light_of_lights() -> None:
    hidden = "custom bool primvars:arnold:visibility:camera = 0\n"
    stage = stage_of(f'def Sphere "s" {{ {hidden} }}\ndef Cube "c" {{}}\ndef RectLight "l" {{ {hidden} }}')
    read_as_arnold(stage)
    scene = StageReader(stage).read(None)
    assert [drawable.paths for drawable in scene.drawables] == [("/c",)]
    assert [light.path for light in scene.lights] == ["/l"]


def test_what_has_no_colour_has_the_renderers_own(tmp_path: Path) -> None:
    (case,) = read_item(item(tmp_path, {"image": "a.tif", "command": "kick cube.usda -r 16 9"}))
    red = 'def Cube "r" {\n color3f[] primvars:displayColor = [(1, 0, 0)]\n}'
    scene = with_bare(case.conditions, StageReader(stage_of(f'def Cube "c" {{}}\n{red}')).read(None))
    np.testing.assert_array_equal(np.concatenate([d.display_color for d in scene.drawables]), [[1, 1, 1], [1, 0, 0]])


def test_a_stage_without_references_is_a_case(tmp_path: Path) -> None:
    (case,) = read_item(item(tmp_path))
    assert (case.image, case.maker) == (None, "none")


def test_an_absent_folder_is_one_sentence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("DEFSHADE_ASSETS", str(tmp_path / "none"))
    with pytest.raises(UsageError, match=r"no stages by others at .*none: let DEFSHADE_ASSETS name the folder"):
        assets_folder()


def test_the_drawing_tests_camera_stands_where_its_arithmetic_puts_it(tmp_path: Path) -> None:
    """Z up: the box's depth enters with the wrong sign, so that a box around y = 2 is seen from −2 − its diagonal."""
    (case,) = read_item(item(tmp_path, STORM))
    scene = StageReader(stage_of(CUBE.partition(")\n")[2], 'upAxis = "Z"')).read(None)
    extent = np.array([[-1.0, 1.0, -1.0], [1.0, 3.0, 1.0]])
    camera = under(case.conditions, scene, extent).camera
    np.testing.assert_allclose(camera.position, [0.0, -2.0 - np.sqrt(12.0), 0.0], atol=1e-12)
    np.testing.assert_allclose(camera.world_from_camera[:3, :3] @ [0, 0, -1], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(camera.window[3], np.tan(np.radians(30.0)) / 2.0)
    np.testing.assert_array_equal(camera.clipping_planes, [[-1.0, 0.0, 0.0, 0.5]])


# Silhouettes


@given(masks, masks)
def test_iou_is_a_share_and_symmetric(a: np.ndarray, b: np.ndarray) -> None:
    iou = intersection_over_union(a, b)
    assert 0.0 <= iou <= 1.0 and iou == intersection_over_union(b, a)
    assert (iou == 1.0) == np.array_equal(a, b)


def test_a_mask_is_what_differs_from_an_even_background() -> None:
    picture = np.full((8, 8, 3), (1.0, 127 / 255, 25 / 255))
    picture[2:5, 3] = (0.9, 127 / 255, 25 / 255)
    background = even_background(picture)
    assert background is not None and mask_of_color(picture, background).sum() == 3
    picture[0, 0] = 0.0
    assert even_background(picture) is None


def test_what_chance_costs_a_silhouette_is_that_of_its_border() -> None:
    """A pixel of which 3/4 are covered is seen by one sample three times in four: of four pixels, it is missed then."""
    whole = np.array([[1.0, 0.0], [1.0, 1.0]])
    assert noise_of(whole, 4, 0.5) == Noise(4, 1.0, 1.0)
    noise = noise_of(np.append(whole, [[0.75, 0.0]], axis=0), 1, 0.5)
    assert noise.low == 0.75 and noise.mean == pytest.approx(0.75 * 1.0 + 0.25 * 0.75, abs=0.02)


def test_only_what_chance_explains_has_a_remark(tmp_path: Path) -> None:
    (case,) = read_item(item(tmp_path, {"image": "a.tif", "command": "kick cube.usda -r 16 9"}))
    noise = Noise(16, 0.95, 0.97)
    assert remark_on(case, 0.96, noise) == "16 random samples a pixel of ours agree with it to 0.9700"
    assert remark_on(case, 0.94, noise) == remark_on(case, 0.96) == remark_on(case, 0.995, noise) == ""


def test_arnold_takes_the_samples_that_its_settings_ask_for() -> None:
    assert samples_of(stage_of('def Cube "c" {}')) == 9
    assert samples_of(stage_of('def RenderSettings "r" {\n custom int arnold:global:AA_samples = 4\n}')) == 16


# Workers


def test_a_worker_that_dies_costs_one_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cases = read_item(item(tmp_path, *({"image": f"{n}.png"} for n in range(3))))

    def run(item: Path, out: Path, left: list, threads: int) -> str:
        """Dies of the second case, and does the others."""
        for case in left:
            if case is cases[1]:
                break
            result = Result(case.key, case.item, case.stage_name, "", case.maker)
            (out / f"{case.key}.json").write_text(json.dumps(result.as_json()))
        return "its worker ended with -11"

    monkeypatch.setattr(batch, "_run_worker", run)
    (results,) = batch.examine_items({tmp_path.name: cases}, tmp_path.parent, tmp_path / "out", 1)
    assert [result.error for result in results] == ["", "its worker ended with -11", ""]


# The page


def results(folder: Path) -> list[Result]:
    (folder / "a.webp").write_bytes(b"picture")
    pictures = {"ours": "a.webp", "reference": "a.webp", "difference": "a.webp"}
    return [
        Result("a-0", "a", "x.usda", "x.png", "storm", iou=0.9999, rmse=0.01, pictures=pictures),
        Result("a-1", "a", "<y>.usda", "y.png", "storm", iou=0.5, unsupported=("/v: volumes are not drawn",)),
        Result("a-2", "a", "p.usda", "p.png", "storm", iou=0.8, remark="discs"),
        Result("a-3", "a", "z.usda", "", "none", error="its worker ended with -11"),
    ]


def test_the_page_holds_everything_itself(tmp_path: Path) -> None:
    page = page_of(results(tmp_path), tmp_path)
    assert re.findall(r'<article class="(\w+)"', page) == ["agrees", "fails", "cannot", "fails"]
    assert page.count("data:image/webp;base64,cGljdHVyZQ==") == 3
    assert "&lt;y&gt;.usda" in page and "/v: volumes are not drawn" in page and "its worker ended with -11" in page
    assert not re.search(r'(?:src|href)="(?!data:)', page) and "{{" not in page


DRIVE = """
  const shown = () => [...document.querySelectorAll("article h2")].map(h => h.textContent);
  const choose = (id, value) => {
    const field = document.getElementById(id);
    field.value = value;
    field.dispatchEvent(new Event("input", {bubbles: true}));
    return [shown(), document.getElementById("count").textContent];
  };
  const told = {all: choose("search", "")};
  told.worst = choose("order", "iou")[0];
  told.fails = choose("verdict", "fails");
  told.found = choose("search", "z.usda STORM")[0].concat(choose("search", "z.usda none")[0]);
  choose("search", ""), choose("verdict", "");
  document.querySelector("article summary").click();
  told.notes = document.querySelector("article li").checkVisibility();
  document.querySelector("article img").click();
  told.close = document.getElementById("close-up").open;
  document.getElementById("close-up").click();
  told.closed = document.getElementById("close-up").open;
  tell(told);
"""


@needs_browser
def test_the_page_in_a_browser(tmp_path: Path) -> None:
    """Sort, choose, search, open what is reported, and look at a picture."""
    (tmp_path / "index.html").write_text(page_of(results(tmp_path), tmp_path))
    assert told_by(tmp_path / "index.html", DRIVE) == {
        "all": [["x.usda", "<y>.usda", "p.usda", "z.usda"], "4 of 4"],
        "worst": ["<y>.usda", "p.usda", "x.usda", "z.usda"],
        "fails": [["<y>.usda", "z.usda"], "2 of 4"],
        "found": ["z.usda"],
        "notes": True,
        "close": True,
        "closed": False,
    }


def test_the_report_says_what_fails(tmp_path: Path) -> None:
    report = report_of(results(tmp_path))
    assert [result["fails"] for result in report["results"]] == [False, True, False, True]
    assert summary_of(results(tmp_path)) == (
        "4 stages, 4 pictures, 1 missing; 1 of 3 silhouettes agree to 0.99, 1 cannot"
    )
    assert [Result.from_json(json.loads(json.dumps(r.as_json()))) for r in results(tmp_path)] == results(tmp_path)


def test_the_table_names_what_is_left_out(tmp_path: Path) -> None:
    table = tables_of(results(tmp_path))
    assert "| a/x.usda | x.png | 0.9999 | 0.0100 |  |" in table
    assert "| a/<y>.usda | volumes are not drawn |" in table


@pytest.fixture(scope="module")
def pipeline(gpu: Gpu) -> Pipeline:
    return Pipeline(gpu)


def test_a_sky_that_the_reference_shows_is_drawn_and_covers_nothing(tmp_path: Path, pipeline: Pipeline) -> None:
    """Half of white, with the π that stages without materials are exposed by."""
    picture = np.full((12, 16, 3), 127, np.uint8)
    picture[3:9, 4:12] = 0
    (tmp_path / "reference").mkdir()
    write_snapshot(picture / np.float32(255), tmp_path / "reference/cube_1.3.png")
    sky = f'{CUBE}def DomeLight "sky" {{\n float inputs:intensity = 0.159\n}}\n'
    plain = {**STORM, "resolution": [16, 12], "command": "test -frameAll -lighting -stage cube.usda"}
    (case,) = read_item(item(tmp_path, plain, stage=sky))
    drawn = draw(case, pipeline)
    np.testing.assert_array_equal(drawn.pictures["ours"][0, 0], np.float32(127 / 255))
    assert drawn.iou is not None and 0.0 < drawn.iou < 1.0


# A part of it, where the stages are


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("ousd_camera_a", ("00", "04")),
        ("ousd_geometry_a", ("00", "02", "04", "07", "08", "09", "10", "12", "13", "14")),
        ("ousd_instancing_a", ("00", "01", "03")),
        ("ousd_point_instancer_a", ("01", "02", "04", "06")),
        ("ousd_preview_surface_a", ("03", "06")),
        ("ousd_purpose_a", ("01", "07")),
        ("ousd_skel_a", ("02", "05")),
        ("ousd_usdlux_a", ("00",)),
        ("wg_geom_schema_a", ("00", "01", "10", "12")),
        ("wg_stage_configuration", ("00", "02", "06")),
    ],
)
def test_silhouettes_agree(assets: Path, pipeline: Pipeline, name: str, keys: tuple[str, ...]) -> None:
    """Solids, points, curves, holes, skins, instances, cameras, clipping, purposes, framing: against Storm."""
    cases = [case for case in read_item(assets / name) if case.key.rpartition("-")[2] in keys]
    found = {case.key: draw(case, pipeline).iou for case in cases}
    assert len(found) == len(keys)
    assert {key: iou for key, iou in found.items() if iou is None or iou < LEAST_IOU} == {}
