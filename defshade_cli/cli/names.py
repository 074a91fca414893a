"""The types of option values that name things, and how the shell completes them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import click

from defshade_cli.cli.types import Finite
from defshade_cli.errors import UsageError
from defshade_cli.settings import VariantChoice

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


class Direction(click.ParamType):
    """`left`, or `30,20` → (azimuth, elevation) in degrees from the front towards +X, and upwards."""

    name = "direction"
    names: ClassVar[dict[str, tuple[float, float]]] = {
        "front": (0.0, 0.0),
        "right": (90.0, 0.0),
        "back": (180.0, 0.0),
        "left": (-90.0, 0.0),
        "top": (0.0, 90.0),
        "bottom": (0.0, -90.0),
    }

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, float]:
        if value in self.names:
            return self.names[value]
        match = re.fullmatch(r"([-+]?\d+(?:\.\d*)?),([-+]?\d+(?:\.\d*)?)", value)
        if not match or abs(float(match[2])) > 90.0:
            known = ", ".join(self.names)
            self.fail(f"{value!r} is none of {known}, nor an azimuth and an elevation such as 30,20", param, ctx)
        return float(match[1]), float(match[2])

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return [_completion(name) for name in self.names if name.startswith(incomplete)]


class Names(click.ParamType):
    """Some of `choices`, separated by commas, each once; `all` for every one."""

    name = "a,b,c"

    def __init__(self, noun: str, choices: Sequence[str]) -> None:
        self.noun, self.choices = noun, tuple(choices)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, ...]:
        if not isinstance(value, str):
            return tuple(value)
        if value == "all":
            return self.choices
        names = [name.strip() for name in value.split(",")]
        for name in names:
            if name not in self.choices:
                self.fail(f"unknown {self.noun} {name!r}; {_suggestion(name, self.choices)}", param, ctx)
        return tuple(dict.fromkeys(names))

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return _list_with(self.choices, incomplete)


class Layers(click.ParamType):
    """Names of layers, ours or another renderer's, separated by commas → ours; `all` for every one of the table."""

    name = "a,b,c"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, ...]:
        from defshade_cli.image.layers import resolve

        names = [name.strip() for name in value.split(",")] if isinstance(value, str) else value
        try:
            return resolve(names)
        except UsageError as error:
            self.fail(str(error), param, ctx)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        from defshade_cli.image.layers import FAMILIES, LAYERS

        return _list_with([*LAYERS, *FAMILIES], incomplete)


class Variant(click.ParamType):
    """`/Car{color=red}` → VariantChoice."""

    name = "variant"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> VariantChoice:
        try:
            return VariantChoice.parse(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


class PrimPaths(click.ParamType):
    """`/World/A,/World/B` → the paths, each once."""

    name = "paths"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, ...]:
        paths = value.replace(",", " ").split()
        for path in paths:
            if not path.startswith("/"):
                self.fail(f"{path!r} is no path of a prim, such as /World/Chair", param, ctx)
        return tuple(dict.fromkeys(paths))


class Threshold(click.ParamType):
    """`flip=0.05` → ("flip", 0.05); a bare number is for the first of `metrics`."""

    name = "threshold"

    def __init__(self, metrics: Sequence[str]) -> None:
        self.metrics = tuple(metrics)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, float]:
        metric, _, number = value.rpartition("=")
        if metric not in ("", *self.metrics):
            self.fail(f"unknown metric {metric!r}; {_suggestion(metric, self.metrics)}", param, ctx)
        return metric or self.metrics[0], Finite().convert(number, param, ctx)


def file_completion(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The shell's own, of files and folders: for names with tokens in them, which click does not know to be paths."""
    return [_completion(incomplete, type="file")]


def _list_with(choices: Sequence[str], incomplete: str) -> list[CompletionItem]:
    """What the last name of a list with commas between may become; the names before it are kept, and not offered."""
    before, comma, begun = incomplete.rpartition(",")
    given = before.split(",")
    return [_completion(f"{before}{comma}{name}") for name in choices if name.startswith(begun) and name not in given]


def _completion(value: str, type: str = "plain") -> CompletionItem:
    from click.shell_completion import CompletionItem

    return CompletionItem(value, type)


def _suggestion(name: str, choices: Sequence[str]) -> str:
    import difflib

    close = difflib.get_close_matches(name, choices, 1)
    return f"did you mean {close[0]!r}?" if close else f"known are {', '.join(choices)}"
