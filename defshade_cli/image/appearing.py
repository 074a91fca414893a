"""Files that appear whole or not at all: written beside their target under a hidden name, then renamed."""

from __future__ import annotations

import os
import platform
import threading
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

from defshade_cli.errors import OutputError


def hidden_prefix() -> str:
    """What the hidden names of this host's writers begin with; the writer's process follows."""
    return f".{platform.node()}-"


@contextmanager
def appearing_at(path: Path) -> Iterator[Path]:
    """The hidden name to write to; folders are made. Raises OSError, and then what stood at `path` still stands."""
    hidden = path.with_name(f"{hidden_prefix()}{os.getpid()}-{threading.get_ident():x}{path.suffix}")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        yield hidden
        hidden.replace(path)
    finally:
        hidden.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """A text file that appears whole; folders are made. A pipe or a terminal has it at once. Raises OutputError."""
    is_stream = path.exists() and not path.is_file()
    try:
        with nullcontext(path) if is_stream else appearing_at(path) as hidden:
            hidden.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}") from error
