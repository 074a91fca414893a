"""A hook for MkDocs: the pages that lie outside docs/ are pages of the site too, and links to them lead there."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parent.parent

OUTSIDE = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "shaders/README.md": "shaders.md",
    "LICENSE": "license.txt",
}
"""File of the repository → page of the site."""

_LINK = re.compile(r"(\]\(|src=\")((?:\.\./|docs/)?[\w./-]+)(#[\w-]+)?(\)|\")")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    for source, page in OUTSIDE.items():
        files.append(File.generated(config, page, content=(ROOT / source).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    return _LINK.sub(lambda link: f"{link[1]}{_on_site(link[2])}{link[3] or ''}{link[4]}", markdown)


def _on_site(target: str) -> str:
    plain = target.removeprefix("../")
    return OUTSIDE.get(plain, plain.removeprefix("docs/"))
