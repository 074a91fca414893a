"""Pages driven in headless Chromium."""

from __future__ import annotations

import html
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

BROWSER = next((path for name in ("chromium", "google-chrome") if (path := shutil.which(name))), None)
_QUIET = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")

needs_browser = pytest.mark.skipif(BROWSER is None, reason="no Chromium")


def told_by(page: Path, script: str) -> Any:
    """Load the page, run `script` in it, and return what it gives to `tell`, through JSON.

    The script is a module's, so it may await; the browser waits for it up to a hundred seconds of its own time.
    """
    ending = "<script>const tell = it => { document.title = JSON.stringify(it); };</script>"
    driven = page.with_name("driven.html")
    driven.write_text(page.read_text().replace("</html>", f'{ending}<script type="module">{script}</script></html>'))
    profile = f"--user-data-dir={page.parent / 'profile'}"
    options = [*_QUIET, profile, "--window-size=800,600", "--virtual-time-budget=100000", "--dump-dom"]
    command = [str(BROWSER), *options, driven.as_uri()]
    shown = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    return json.loads(html.unescape(shown.partition("<title>")[2].partition("</title>")[0]))
