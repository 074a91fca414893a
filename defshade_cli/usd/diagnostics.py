"""What USD says is wrong, as text."""

from __future__ import annotations

from typing import Any


def commentary(diagnostic: Any) -> str:
    """The text of a Tf diagnostic; files that lie put bytes into it that are no text, and it then cannot be had."""
    try:
        return str(diagnostic.commentary).strip()
    except UnicodeDecodeError:
        return "it holds what is no text"
