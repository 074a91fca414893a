"""Where the package's own data lies, beside the package in a checkout, inside it in a wheel; and what it runs on."""

from __future__ import annotations

import os
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def _folder(name: str) -> Path:
    packaged = _PACKAGE / name
    return packaged if packaged.is_dir() else _PACKAGE.parent / name


SHADERS = _folder("shaders")
SCENES = _folder("scenes")


def cache_folder(kind: str) -> Path:
    """Where what can be made again is kept, by the XDG Base Directory Specification."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "defshade" / kind


def core_count() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0))
