"""Pages that are one file: templates with {{places}}, filled and written whole."""

from __future__ import annotations

import re
from pathlib import Path

from defshade_cli.errors import OutputError
from defshade_cli.image.appearing import appearing_at

_STYLE = Path(__file__).with_name("page.css")


def filled(template: Path, **parts: str) -> str:
    """The template with a part in each {{place}} of its name; {{style}} is the look that all pages share."""
    parts["style"] = _STYLE.read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda place: parts[place[1]], template.read_text(encoding="utf-8"))


def place(path: Path, text: str) -> None:
    """A text file that appears whole; folders are made. Raises OutputError."""
    try:
        with appearing_at(path) as hidden:
            hidden.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}") from error
