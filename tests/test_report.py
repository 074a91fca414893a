"""The report of a batch: its record, its page, and the page in a browser."""

from __future__ import annotations

import html
import json
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from defshade_cli.farm.report import write_report
from defshade_cli.farm.tasks import Chunk, Outcome
from defshade_cli.image.files import write
from defshade_cli.settings import OutputSettings, RenderJob
from films import film

BROWSER = next((path for name in ("chromium", "google-chrome") if (path := shutil.which(name))), None)
QUIET = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")


@pytest.fixture
def report(tmp_path: Path) -> Iterator[Path]:
    """Of two stages: two frames, one with a warning, and one frame that failed."""
    outcomes = []
    for frame in (1.0, 2.0):
        path = tmp_path / f"shot.{frame:g}.exr"
        write(film("beauty", "depth", "normal"), OutputSettings(), path)
        task = Chunk(RenderJob(Path("shot.usda"), (frame,)))
        log = "defshade: warning: a <light> is dark\n" if frame == 2.0 else ""
        outcomes.append(Outcome(task, frame, (path,), seconds={"draw": 0.25}, log=log))
    broken = Chunk(RenderJob(Path("broken.usda"), (1.0,)), attempt=2)
    outcomes.append(Outcome(broken, 1.0, error="broken.usda is not a USD stage", log="line 3: <oops>\n"))
    write_report(outcomes, 12.5, tmp_path / "out" / "report.html")
    return tmp_path / "out" / "report.html"


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


DRIVE = """<script>
  document.querySelector('#layers button[data-layer="depth"]').click();
  document.querySelector("figure.failed details").open = true;
  document.getElementById("troubles").click();
  scrollTo(0, 50);
  const shown = [...document.querySelectorAll("figure:not([hidden]) img.shown")].map(image => image.dataset.layer);
  const widths = [...document.querySelectorAll("img.shown")].map(image => image.naturalWidth);
  const log = document.querySelector("figure.failed pre").textContent;
  document.title = JSON.stringify({shown, log, hidden: document.querySelectorAll("figure[hidden]").length});
</script>"""


@pytest.mark.skipif(BROWSER is None, reason="no Chromium")
def test_the_page_in_a_browser(report: Path, tmp_path: Path) -> None:
    """Switch to a layer, open the log of the frame that failed, keep only troubles: what the page then shows."""
    driven = tmp_path / "driven.html"
    driven.write_text(report.read_text().replace("</html>", DRIVE + "</html>"))
    profile = f"--user-data-dir={tmp_path / 'profile'}"
    command = [str(BROWSER), *QUIET, profile, "--dump-dom", driven.as_uri()]
    shown = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    title = html.unescape(shown.partition("<title>")[2].partition("</title>")[0])
    assert json.loads(title) == {"shown": ["depth"], "log": "line 3: <oops>\n", "hidden": 1}
