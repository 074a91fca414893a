"""Opening stages, what USD says meanwhile, and what a stage says about itself."""

from __future__ import annotations

import logging
import shutil
import struct
from pathlib import Path

import pytest
from pxr import Tf, Usd, UsdGeom, UsdUtils

from defshade_cli.errors import StageNotFound
from defshade_cli.usd.opening.stage import (
    first_frame,
    frames_per_second,
    meters_per_unit,
    open_stage,
    stage_name,
    up_axis,
)
from defshade_cli.usd.reader import StageReader
from stages import positions, stage_of

CUBE = '#usda 1.0\ndef Cube "cube" {\n}\n'
BROKEN_REFERENCES = """#usda 1.0
def "a" (references = @missing_a.usda@) {
}
def "b" (references = @missing_b.usda@) {
}
def "c" (references = @missing_a.usda@) {
}
"""


def test_a_missing_file_says_so(tmp_path: Path) -> None:
    with pytest.raises(StageNotFound, match=r"no such file: .*nothing\.usda"):
        open_stage(tmp_path / "nothing.usda")


@pytest.mark.parametrize("name", ["text.usda", "text.usdc", "text.usdz", "text.txt"])
def test_what_is_not_usd_says_so_in_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("hello")
    with pytest.raises(StageNotFound, match=r"is not a USD stage: .+") as caught:
        open_stage(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_a_folder_is_no_stage(tmp_path: Path) -> None:
    with pytest.raises(StageNotFound, match="is not a USD stage"):
        open_stage(tmp_path)


@pytest.mark.parametrize("suffix", ["usd", "usda", "usdc", "usdz"])
def test_every_format_opens(tmp_path: Path, suffix: str) -> None:
    stage = stage_of('def Cube "cube" {\n}')
    path = tmp_path / f"cube.{suffix}"
    if suffix == "usdz":
        stage.GetRootLayer().Export(str(tmp_path / "inside.usdc"))
        assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "inside.usdc"), str(path))
    else:
        stage.GetRootLayer().Export(str(path))
    opened = open_stage(path)
    assert stage_name(opened) == "cube"
    assert positions(StageReader(opened).read(None)) == [(0, 0, 0)]


def test_usd_is_gathered_instead_of_scrolling(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "broken.usda").write_text(BROKEN_REFERENCES)
    with caplog.at_level(logging.WARNING, "defshade"):
        open_stage(tmp_path / "broken.usda")
    assert capfd.readouterr().err == ""
    (message,) = [record.getMessage() for record in caplog.records]
    assert message == (
        "the stage is incomplete: could not open asset @missing_a.usda@ for reference (/a and 1 more); "
        "could not open asset @missing_b.usda@ for reference (/b)"
    )


def test_what_is_missing_is_listed_with_its_prim(tmp_path: Path) -> None:
    (tmp_path / "broken.usda").write_text(BROKEN_REFERENCES + CUBE.removeprefix("#usda 1.0"))
    listed = StageReader(open_stage(tmp_path / "broken.usda")).read(None).unsupported
    assert [issue.path for issue in listed] == ["/a", "/b", "/c"]
    assert "@missing_b.usda@" in listed[1].reason


def test_payloads_are_loaded(tmp_path: Path) -> None:
    (tmp_path / "part.usda").write_text('#usda 1.0\n(\ndefaultPrim = "cube"\n)\ndef Cube "cube" {\n}\n')
    (tmp_path / "whole.usda").write_text('#usda 1.0\ndef "model" (payload = @part.usda@) {\n}\n')
    assert len(StageReader(open_stage(tmp_path / "whole.usda")).read(None).drawables) == 1


@pytest.mark.parametrize(
    ("metadata", "axis"), [("", "Y"), ('upAxis = "Z"', "Z"), ('upAxis = "X"', "Z"), ('upAxis = "up"', "Z")]
)
def test_the_up_axis_is_y_or_z(metadata: str, axis: str) -> None:
    assert up_axis(stage_of("", metadata)) == axis


@pytest.mark.parametrize(
    ("metadata", "metres"),
    [("", 0.01), ("metersPerUnit = 1", 1.0), ("metersPerUnit = 0", 0.01), ("metersPerUnit = -2", 0.01)],
)
def test_metres_are_positive(metadata: str, metres: float) -> None:
    assert meters_per_unit(stage_of("", metadata)) == metres


def test_metres_may_be_single_precision(assets: Path) -> None:
    """UsdGeom's own accessor raises on the float metadata of old files."""
    assert meters_per_unit(open_stage(assets / "tiny_blender_exports_a" / "suzanne.usdc")) == 1.0


def test_metres_in_single_precision_are_read_where_usds_accessor_raises(tmp_path: Path) -> None:
    """A crate file whose metersPerUnit is marked as a float, as old exporters wrote it: types are 9 and 8."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "double.usdc"))
    UsdGeom.SetStageMetersPerUnit(stage, 0.25)
    stage.Save()
    double = struct.pack("<f", 0.25) + b"\x00\x00\x09\x40"
    crate = (tmp_path / "double.usdc").read_bytes()
    assert crate.count(double) == 1
    (tmp_path / "single.usdc").write_bytes(crate.replace(double, double[:6] + b"\x08\x40"))
    old = open_stage(tmp_path / "single.usdc")
    with pytest.raises(Tf.ErrorException):
        UsdGeom.GetStageMetersPerUnit(old)
    assert meters_per_unit(old) == 0.25


@pytest.mark.parametrize(
    ("metadata", "rate"),
    [
        ("", 24.0),
        ("framesPerSecond = 25\ntimeCodesPerSecond = 50", 25.0),
        ("timeCodesPerSecond = 50", 50.0),
        ("timeCodesPerSecond = 0", 24.0),
        ("timeCodesPerSecond = -30", 24.0),
    ],
)
def test_frames_per_second_are_positive(metadata: str, rate: float) -> None:
    assert frames_per_second(stage_of("", metadata)) == rate


@pytest.mark.parametrize("rate", [0.0, -25.0, float("inf")])
def test_a_rate_of_frames_that_is_none_counts_as_not_authored(rate: float) -> None:
    """USD's text refuses such a rate; crate files hold it."""
    stage = stage_of("", "timeCodesPerSecond = 50")
    stage.SetFramesPerSecond(rate)
    assert stage.GetFramesPerSecond() == rate
    assert frames_per_second(stage) == 50.0


@pytest.mark.parametrize(
    ("metadata", "frame"),
    [
        ("", None),
        ("startTimeCode = 3\nendTimeCode = 9", 3.0),
        ("startTimeCode = -5\nendTimeCode = -1", -5.0),
        ("startTimeCode = 9\nendTimeCode = 3", 9.0),
    ],
)
def test_the_first_frame_is_the_start_of_the_range(metadata: str, frame: float | None) -> None:
    assert first_frame(stage_of("", metadata)) == frame


@pytest.mark.parametrize("rate", [0, -24])
def test_time_codes_without_a_rate_do_not_hang(rate: int) -> None:
    text = """def Cube "cube" {
        double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (10, 0, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }"""
    reader = StageReader(stage_of(text, f"timeCodesPerSecond = {rate}\nstartTimeCode = 0\nendTimeCode = 10"))
    assert positions(reader.read(10.0)) == [(10, 0, 0)]


def test_a_file_that_came_from_elsewhere_keeps_its_name(tmp_path: Path) -> None:
    (tmp_path / "shot.v012.usda").write_text(CUBE)
    shutil.copy(tmp_path / "shot.v012.usda", tmp_path / "copy.usda")
    assert stage_name(open_stage(tmp_path / "shot.v012.usda")) == "shot.v012"


def test_a_layer_of_bytes_that_are_no_text_is_one_sentence(tmp_path: Path) -> None:
    """USD quotes such bytes, and its message can then not be had as text."""
    path = tmp_path / "odd.usda"
    path.write_bytes(b'#usda 1.0\ndef Sphere "b\xec\xa0ll" {\n  double \xb0radius = 1\n}\n')
    with pytest.raises(StageNotFound, match="is not a USD stage: it holds what is no text"):
        open_stage(path)
