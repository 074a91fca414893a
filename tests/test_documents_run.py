"""Every command block of the documents is run, page by page, in a reader's folder: smaller, but as it stands."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from readers_folder import JOB_FILE, PICTURES, furnish

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "shaders").glob("*.md")])
BLOCK = re.compile(r"^```(sh|text|python|yaml)\n(.*?)^```", re.MULTILINE | re.DOTALL)

SMALLER = (
    (r"--size \d+x\d+", "--size 32x32"),
    (r"--width \d+", "--width 64"),
    (r"--samples (\d+)(?![\d,])", "--samples 1"),
    (r"defshade bench (.*)--samples 1,16,256", r"defshade bench \1"),
    (r"defshade bench ", "defshade bench --layouts float --samples 1,4 --rounds 1 --reference-samples 16 "),
    (r"--turntable \d+", "--turntable 3"),
    (r"--frames 1:(240|100|48)(?!x)", "--frames 1:3"),
    (r"1:48x2,101", "1:3x2,5"),
    (r"samples: 16\n  size: 1280x720", "samples: 1\n  size: 32x32"),
    (r"benchmarks/lights.py 1920x1080", "benchmarks/lights.py 96x54"),
)
"""A page's words → what takes less time."""

ELSEWHERE = (
    (r"^make ", f"make -n -C {ROOT} "),  # that they stand in the Makefile; CI and users run them
    (r"^apt-get install ", "command -v apt-get >/dev/null && apt-get install --simulate "),
    (r"\.venv/bin/python benchmarks/", f"python {ROOT}/benchmarks/"),
    (r"^(dask (?:scheduler|worker) .*)$", r"\1 --host 127.0.0.1 & sleep 3"),
    (r"tcp://farm:8786", "$FARM"),
    (r"^(.*benchmarks/errors.py)", r": \1"),  # reads what an hour of `make bench` leaves
)
"""A page's words → what does the same without root, a farm or an hour."""

PRELUDE = """set -euo pipefail
srun() { "$@"; }
command -v ffmpeg >/dev/null || ffmpeg() { ls out/chair.01.png; }
SLURM_ARRAY_TASK_ID=1
"""
"""What a film-maker's and a farm's machine have."""

FARM = """FARM=tcp://127.0.0.1:{port}
dask scheduler --host 127.0.0.1 --port {port} --no-dashboard 2>/dev/null & sleep 3
dask worker $FARM --nthreads 1 --resources GPU=1 --no-nanny --no-dashboard 2>/dev/null &
"""
"""For pages that speak of a farm."""


def _blocks(page: Path) -> Iterator[tuple[str, str]]:
    """(language, text) of what is meant to be run; of a text block the examples of a command."""
    for language, text in BLOCK.findall(page.read_text(encoding="utf-8")):
        if language != "text" or text.startswith("Examples:"):
            yield language, text.removeprefix("Examples:\n").partition("\n\n")[0] + "\n"


def _here(text: str, port: int) -> str:
    for words, others in (*SMALLER, *ELSEWHERE):
        text = re.sub(words, others, text, flags=re.MULTILINE)
    return text.replace("8786", str(port))


def _free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


def _script(page: Path, port: int) -> Iterator[str]:
    """The page as one script of bash; each block begins where the reader is, in the folder."""
    for language, text in _blocks(page):
        if language == "yaml":
            yield f"cat > {JOB_FILE} <<'YAML'\n{_here(text, port)}YAML\n"
        elif language == "python":
            yield f"python - <<'PYTHON'\n{text}PYTHON\n"
        else:
            yield "\n".join(line.strip() for line in _here(text, port).splitlines() if line.strip()) + "\n"


def _run(script: str, folder: Path) -> None:
    """Run it there, and end what it left running."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(folder / "cache")}
    log = folder / "log.txt"
    with log.open("w") as told:
        shell = subprocess.Popen(
            ["bash", "-xc", PRELUDE + script], cwd=folder, env=environment, stdout=told, stderr=told, process_group=0
        )
        try:
            code = shell.wait(timeout=600)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(shell.pid, signal.SIGKILL)
    if code:
        pytest.fail(f"{log.read_text(errors='replace')[-3000:]}\nexit code {code}", pytrace=False)


@pytest.mark.parametrize("page", [page for page in PAGES if any(_blocks(page))], ids=lambda page: page.name)
def test_blocks_run(page: Path, tmp_path: Path) -> None:
    furnish(tmp_path)
    script = "".join(_script(page, _free_port()))
    farm = FARM.format(port=_free_port()) if "$FARM" in script else ""
    _run(PICTURES * (".exr" in script) + farm + script, tmp_path)
