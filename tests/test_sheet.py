"""Contact sheets of layers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from defshade_cli.cli import defshade
from defshade_cli.image.colour import display_transform
from defshade_cli.image.false_colour import colors_of_ids
from defshade_cli.image.files import targets, write
from defshade_cli.image.film import Film
from defshade_cli.image.layers import LAYERS
from defshade_cli.image.look import look_at_film
from defshade_cli.image.reading import read, read_header
from defshade_cli.image.sheet import TILE, contact_sheet
from defshade_cli.settings import OutputSettings
from films import film

SHEET = OutputSettings(sheet=True)


def sheet_of(film: Film, *names: str) -> NDArray[np.float32]:
    return contact_sheet({name: look_at_film(film, name, display_transform()) for name in names})


def test_every_layer_of_the_table_has_a_tile() -> None:
    """As wide as the film, over its strip; nothing is not a number, whatever the layers hold."""
    everything = film(size=(64, 36))
    sheet = sheet_of(everything, *LAYERS)
    assert np.isfinite(sheet).all() and sheet.min() >= 0.0 and sheet.max() <= 1.0
    columns = (sheet.shape[1] - 8) // (64 + 8)
    assert sheet.shape[0] == 8 + -(-len(LAYERS) // columns) * (36 + 44 + 8)


def test_large_films_become_tiles() -> None:
    sheet = sheet_of(film("beauty", size=(1000, 500)), "beauty")
    assert sheet.shape == (TILE // 2 + 44 + 16, TILE + 16, 3)


def test_near_is_bright_and_what_is_endless_is_black() -> None:
    depth = np.full((20, 300, 1), np.inf, np.float32)
    depth[:, :100], depth[:, 100:200] = 1.0, 5.0
    sheet = sheet_of(replace(film("depth"), layers={"depth": depth}), "depth")
    near, far, endless = (sheet[18, 8 + x].sum() for x in (50, 150, 250))
    assert near > far > endless == 0.0


def test_ids_have_the_colours_that_their_legend_shows() -> None:
    ids = np.full((20, 300, 1), 7.0, np.float32)
    source = replace(film("primId"), layers={"primId": ids}, manifests={"primId": {7: "/World/Chair"}})
    sheet = sheet_of(source, "primId")
    color = colors_of_ids(np.array([7], np.uint32))[0]
    assert sheet[18, 100] == pytest.approx(color)
    assert (np.abs(sheet[28:] - color).max(axis=-1) < 1e-6).sum() == 16 * 18


def test_a_sheet_is_one_file_that_says_what_it_is_of(tmp_path: Path) -> None:
    path = tmp_path / "sheet.png"
    assert write(film("beauty", "depth", "normal"), SHEET, path) == (path,)
    assert list(tmp_path.iterdir()) == [path]
    assert read_header(path)["scene"] == "kitchen"
    assert read(path)["beauty"].shape[2] == 3


def test_exr_beside_a_sheet_stays_what_it_is(tmp_path: Path) -> None:
    names = ("beauty", "depth")
    assert targets(names, SHEET, tmp_path / "a.exr") == targets(names, OutputSettings(), tmp_path / "a.exr")


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["-o", "a.exr"], "--sheet is a picture"),
        (["-o", "a.png", "--split-layers"], "--sheet and --split-layers exclude each other"),
    ],
)
def test_what_does_not_go_together_is_said(scenes: Path, options: list[str], complaint: str) -> None:
    result = CliRunner().invoke(defshade, ["gbuffer", str(scenes / "gprims.usda"), "--sheet", *options])
    assert result.exit_code != 0 and complaint in result.output + str(result.exception)
