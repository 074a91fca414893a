"""A job as the options that would make it: the way back from options.make_job."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields
from typing import Any

import click

from defshade_cli.cli.types import Crop, Size
from defshade_cli.settings import Composition, OutputSettings, RenderJob, RenderSettings

_OWNERS = {"composition", "settings", "output"}
_NOT_OPTIONS = _OWNERS | {"stage", "frames", "session_layers", "patterns", "fallback", "variables", "given"}


def option_arguments(job: RenderJob, params: Iterable[click.Parameter]) -> list[str]:
    """What to type for all of the job that is not the default: stage, session layers, frames and output files apart.

    params: of the command, the options among them.
    """
    options = {param.name: param for param in params if isinstance(param, click.Option)}
    chosen = dict(_chosen(job))
    return [part for name, value in chosen.items() for part in _typed(options[name], value)]


def _chosen(job: RenderJob) -> Iterator[tuple[str, Any]]:
    """Names and values of the fields that differ from their defaults."""
    defaults = (
        (job, RenderJob(job.stage)),
        (job.composition, Composition()),
        (job.settings, RenderSettings()),
        (job.output, OutputSettings()),
    )
    for owner, default in defaults:
        for field in fields(owner):
            value = getattr(owner, field.name)
            if field.name not in _NOT_OPTIONS and value != getattr(default, field.name):
                yield field.name, value


def _typed(option: click.Option, value: Any) -> list[str]:
    if option.is_flag:
        return [option.opts[-1] if value else option.secondary_opts[-1]]
    if option.multiple:
        return [part for item in value for part in (option.opts[-1], str(item))]
    if isinstance(option.type, Size | Crop):
        return [option.opts[-1], option.type.text(value)]
    return [option.opts[-1], ",".join(map(str, value)) if isinstance(value, tuple) else str(value)]
