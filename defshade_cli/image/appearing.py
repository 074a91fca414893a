"""Files that appear whole or not at all: written beside their target under a hidden name, then renamed."""

from __future__ import annotations

import os
import platform
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


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
