"""Settings that a stage's RenderSettings prim carries for us, under those that the user gave."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from defshade_cli.errors import UsageError
from defshade_cli.settings import CHOICES, RenderJob, RenderSettings

log = logging.getLogger("defshade")

OWN = {
    "samples": int,
    "light_points": int,
    "max_error": float,
    "time_limit": float,
    "filter": str,
    "filter_width": float,
    "cryptomatte_levels": int,
    "layout": str,
    "shading": str,
    "ocio": str,
    "exposure": float,
    "shadows": bool,
    "complexity": str,
    "background": bool,
    "motion_blur": bool,
    "fit": bool,
    "studio": bool,
}
"""The fields of RenderSettings that UsdRender has no place for, and what they hold."""


def with_own_settings(job: RenderJob, authored: Mapping[str, Any]) -> RenderJob:
    """`job` with what the stage says wherever the user gave nothing. What is not ours is logged.

    Raises UsageError for a value of the wrong type, or none of the choices.
    """
    for name in authored.keys() - OWN.keys():
        log.warning("the render settings have defshade:%s, which means nothing here", name)
    chosen = {name: _valid(name, value) for name, value in authored.items() if name in OWN and name not in job.given}
    return replace(job, settings=replace(job.settings, **chosen))


def own_settings(settings: RenderSettings) -> dict[str, Any]:
    """Those of `settings` that are not the defaults and that UsdRender has no place for."""
    return {
        field.name: OWN[field.name](getattr(settings, field.name))
        for field in fields(settings)
        if field.name in OWN and getattr(settings, field.name) != field.default
    }


def _valid(name: str, value: Any) -> Any:
    kind = OWN[name]
    if not isinstance(value, (int, float) if kind is float else kind):
        raise UsageError(f"defshade:{name} of the render settings is {value!r}, not of type {kind.__name__}")
    if name in CHOICES and value not in CHOICES[name]:
        raise UsageError(f"defshade:{name} of the render settings is {value!r}; there are {', '.join(CHOICES[name])}")
    return kind(value)
