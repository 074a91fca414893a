"""defshade: a headless, deferred batch renderer for USD stages.

from defshade_cli import render
film = render("scene.usda", samples=16)
film.layers["beauty"]          # (height, width, 4) float32, scene-linear
"""

from __future__ import annotations

from typing import Any

__version__ = "0.1.0"
__all__ = ["__version__", "render"]


def __getattr__(name: str) -> Any:
    """Import `render` when it is first asked for: `defshade --help` must not load a GL stack."""
    if name == "render":
        from defshade_cli.rendering import render

        return render
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
