"""Pages that are one file: templates with {{places}}, filled."""

from __future__ import annotations

import re
from pathlib import Path

_STYLE = Path(__file__).with_name("page.css")


def filled(template: Path, **parts: str) -> str:
    """The template with a part in each {{place}} of its name; {{style}} is the look that all pages share."""
    parts["style"] = _STYLE.read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda place: parts[place[1]], template.read_text(encoding="utf-8"))
