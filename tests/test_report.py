"""The report of a batch: its record, its page, and the page in a browser."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from browser import needs_browser, told_by
from defshade_cli.farm.report import write_report
from defshade_cli.farm.tasks import Chunk, Outcome
from defshade_cli.image.files import write
from defshade_cli.settings import OutputSettings, RenderJob
from films import film


def written_report(folder: Path, frames: int) -> Path:
    """Of two stages: frames of which the second has a warning, and one frame that failed."""
    path = folder / "shot.exr"
    write(film("beauty", "depth", "normal"), OutputSettings(), path)
    outcomes = []
    for frame in map(float, range(1, frames + 1)):
        task = Chunk(RenderJob(Path("shot.usda"), (frame,)))
        log = "defshade: warning: a <light> is dark\n" if frame == 2.0 else ""
        outcomes.append(Outcome(task, frame, (path,), seconds={"draw": 0.25}, log=log))
    broken = Chunk(RenderJob(Path("broken.usda"), (1.0,)), attempt=2)
    outcomes.append(Outcome(broken, 1.0, error="broken.usda is not a USD stage", log="line 3: <oops>\n"))
    write_report(outcomes, 12.5, folder / "out" / "report.html")
    return folder / "out" / "report.html"


@pytest.fixture
def report(tmp_path: Path) -> Path:
    return written_report(tmp_path, frames=2)


def test_the_record_holds_every_frame(report: Path) -> None:
    record = json.loads(report.with_suffix(".json").read_text())
    assert record["seconds"] == 12.5
    frames = {(f["stage"], f["frame"]): f for f in record["frames"]}
    assert len(frames) == 3
    assert frames["shot.usda", 1.0]["samples"] == 16
    assert frames["broken.usda", 1.0]["failure"] == "broken.usda is not a USD stage"
    assert frames["broken.usda", 1.0]["attempts"] == 2


def test_the_page_is_one_file_that_escapes_what_it_quotes(report: Path) -> None:
    page = report.read_text()
    assert "3 frames in 12.5 s: 2 rendered, 0 skipped, 1 failed" in page
    assert page.count("data:image/jpeg;base64,") == 6
    assert "&lt;oops&gt;" in page and "<oops>" not in page
    assert "http" not in page and "{{" not in page


def test_an_unreadable_image_is_told(tmp_path: Path) -> None:
    (tmp_path / "cut.exr").write_bytes(b"no image")
    outcome = Outcome(Chunk(RenderJob(Path("a.usda"), (1.0,))), 1.0, (tmp_path / "cut.exr",))
    write_report([outcome], 1.0, tmp_path / "r.html")
    assert "cannot be read" in (tmp_path / "r.html").read_text()


DRIVE = """
  const failed = document.querySelector("figure.failed"), log = failed.querySelector("pre");
  const last = [...document.querySelectorAll("figure.fine img.shown")].at(-1);
  const low = () => Math.round(last.getBoundingClientRect().top);
  const seen = element => element.checkVisibility() && element.getBoundingClientRect().height > 0;
  const frames = () => [...document.querySelectorAll("figure")].filter(seen).length;
  const layers = () => [...new Set([...document.querySelectorAll("img")].filter(seen).map(i => i.dataset.layer))];
  const told = {before: [layers(), frames(), seen(log), low() > innerHeight]};
  scrollTo(0, document.body.scrollHeight);
  told.scrolled = [scrollY > 0, low() < innerHeight, last.naturalWidth > 0];
  told.header = Math.round(document.querySelector("header").getBoundingClientRect().top);
  document.querySelector('#layers button[data-layer="depth"]').click();
  told.switched = [layers(), document.querySelector("button.chosen").textContent];
  failed.querySelector("summary").click();
  told.log = [seen(log), log.textContent];
  document.getElementById("troubles").click();
  told.troubles = frames();
  tell(told);
"""


@needs_browser
def test_the_page_in_a_browser(tmp_path: Path) -> None:
    """Scroll to the end, switch to a layer, open the log of the frame that failed, keep only troubles."""
    assert told_by(written_report(tmp_path, frames=40), DRIVE) == {
        "before": [["beauty"], 41, False, True],
        "scrolled": [True, True, True],
        "header": 0,
        "switched": [["depth"], "depth"],
        "log": [True, "line 3: <oops>\n"],
        "troubles": 2,
    }
