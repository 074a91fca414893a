"""What USD says is wrong, as text. Files that lie put bytes into it that are no text, and it then cannot be had."""

from __future__ import annotations

from typing import Any

_NO_TEXT = "it holds what is no text"


def commentary(diagnostic: Any) -> str:
    """The text of a Tf diagnostic."""
    try:
        return str(diagnostic.commentary).strip()
    except UnicodeDecodeError:
        return _NO_TEXT


def described(error: Any) -> str:
    """The text of an error of composition."""
    try:
        return str(error).strip()
    except UnicodeDecodeError:
        return _NO_TEXT
