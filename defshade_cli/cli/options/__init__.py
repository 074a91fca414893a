"""The options that commands share, and the frozen job that they become."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import click

from defshade_cli.cli.options.image import image_options
from defshade_cli.cli.options.option import Function, HeadedCommand, Option, epilog
from defshade_cli.cli.options.output import output_options
from defshade_cli.cli.options.run import Reporting, run_options
from defshade_cli.cli.options.stage import stage_options
from defshade_cli.errors import UsageError
from defshade_cli.settings import Composition, OutputSettings, RenderJob, RenderSettings

__all__ = [
    "Function",
    "HeadedCommand",
    "Option",
    "Reporting",
    "epilog",
    "make_job",
    "render_options",
    "take",
    "takes_job",
    "takes_stage",
    "with_output",
]


def takes_stage(function: Function) -> Function:
    """Give a command the options of stage and image: it is called with a RenderJob and its own keywords.

    The command raises UsageError for options that do not go together.
    """
    return _takes([_scene_argument(), *stage_options(), *image_options()], function)


def takes_job(*, layers: Sequence[str] = (), name: str = "{scene}") -> Callable[[Function], Function]:
    """Give a command every option of a render: it is called with a RenderJob and a Reporting.

    layers: written when the user names none; without them what the stage names.
    name: of the output, without frame and suffix, likewise; with layers of its own the command has a name of its own.
    The command raises UsageError for options that do not go together.
    """

    def decorate(function: Function) -> Function:
        @functools.wraps(function)
        def command(job: RenderJob, **values: Any) -> Any:
            return function(with_output(job, name, fixed=bool(layers)), Reporting(**take(values, Reporting)), **values)

        return _takes([_scene_argument(), *render_options(layers, name)], command)

    return decorate


def render_options(layers: Sequence[str] = (), name: str = "{scene}") -> list[Function]:
    """Every option of a render, with the defaults that takes_job tells of."""
    return [*stage_options(), *image_options(layers), *output_options(name), *run_options()]


def _takes(options: list[Function], function: Function) -> Function:
    @functools.wraps(function)
    def command(**values: Any) -> Any:
        job = make_job(values)
        return function(job, **values)

    for option in reversed(options):
        command = option(command)
    return command


def make_job(values: dict[str, Any]) -> RenderJob:
    """The RenderJob in a command's `values`, which keep only what is the command's own.

    Raises UsageError for options that exclude each other.
    """
    if values["size"] and values["width"]:
        raise UsageError("--size and --width exclude each other")
    if values["frames"] and values["default_time"]:
        raise UsageError("--frames and --default-time exclude each other")
    _check_camera(values)
    _check_output(values)
    values["mask"] = values["mask"] or ()
    given = values.pop("given", frozenset()) | _typed()
    default_time = values.pop("default_time")
    values["frames"] = (None,) if default_time else values["frames"] or ()
    return RenderJob(
        stage=values.pop("scene"),
        composition=Composition(**take(values, Composition)),
        settings=RenderSettings(**take(values, RenderSettings)),
        output=OutputSettings(**take(values, OutputSettings)),
        given=given,
        **take(values, RenderJob),
    )


def _check_output(values: dict[str, Any]) -> None:
    """Not all commands have output."""
    if values.get("sheet") and values["split_layers"]:
        raise UsageError("--sheet and --split-layers exclude each other")
    patterns = values.get("patterns")
    if values.get("sheet") and patterns and all(pattern.lower().endswith(".exr") for pattern in patterns):
        raise UsageError("--sheet is a picture: give -o a name such as sheet.png")


def _check_camera(values: dict[str, Any]) -> None:
    ours = next((name for name in ("turntable", "fit") if values[name]), None)
    if ours and values["camera"]:
        raise UsageError(f"--camera and --{ours} exclude each other")
    if values["turntable"] and values["default_time"]:
        raise UsageError("--turntable and --default-time exclude each other")
    if values["direction"] and not ours:
        raise UsageError("--direction is for --fit and --turntable")


def _typed() -> frozenset[str]:
    """Names of the RenderSettings that stand on the command line."""
    context = click.get_current_context(silent=True)
    if context is None:
        return frozenset()
    typed = click.core.ParameterSource.COMMANDLINE
    return frozenset(f.name for f in fields(RenderSettings) if context.get_parameter_source(f.name) is typed)


def take(values: dict[str, Any], owner: Any) -> dict[str, Any]:
    """Those of `values` that are fields of the dataclass `owner`, removed from `values`."""
    return {name: values.pop(name) for name in owner.__dataclass_fields__ if name in values}


def with_output(job: RenderJob, name: str, *, fixed: bool = False) -> RenderJob:
    """`job` with the default file name where the user gave none. fixed: whatever names the stage's products have."""
    suffix = ".png" if job.output.sheet else ".exr"
    fallback = f"{name}.####{suffix}" if len(job.frames) > 1 else f"{name}{suffix}"
    patterns = job.output.patterns or (fallback,) * fixed
    return replace(job, output=replace(job.output, patterns=patterns, fallback=fallback))


def _scene_argument() -> Function:
    return click.argument("scene", type=click.Path(path_type=Path))
