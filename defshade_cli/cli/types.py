"""The types of option values: each turns text that a user typed into a value, or says what is wrong."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

import click

from defshade_cli.errors import UsageError

Region = tuple[int, int, int, int]
"""(x, y, width, height) in pixels."""


class Size(click.ParamType):
    """`1920x1080` → (1920, 1080)."""

    name = "WxH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        match = re.fullmatch(r"([1-9]\d*)x([1-9]\d*)", value)
        if not match:
            self.fail(f"{value!r} is not a size in pixels such as 1920x1080", param, ctx)
        return int(match[1]), int(match[2])

    def text(self, value: tuple[int, int]) -> str:
        """The value as it is typed."""
        return f"{value[0]}x{value[1]}"


class Crop(click.ParamType):
    """`640x360+100-20` → (100, -20, 640, 360), as oiiotool writes regions."""

    name = "WxH+X+Y"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Region:
        match = re.fullmatch(r"([1-9]\d*)x([1-9]\d*)([+-]\d+)([+-]\d+)", value)
        if not match:
            self.fail(f"{value!r} is not a part of the image such as 640x360+100+50", param, ctx)
        width, height, x, y = map(int, match.groups())
        return x, y, width, height

    def text(self, value: Region) -> str:
        """The value as it is typed."""
        x, y, width, height = value
        return f"{width}x{height}{x:+d}{y:+d}"


class Finite(click.ParamType):
    """A float that is neither infinite nor NaN."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a finite number", param, ctx)
        return number


class Positive(Finite):
    """A finite float above 0."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = super().convert(value, param, ctx)
        if number <= 0.0:
            self.fail(f"{value!r} is not above 0", param, ctx)
        return number


class Frames(click.ParamType):
    """`1:10x2,15` → time codes; the syntax is farm.frames'."""

    name = "frames"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        from defshade_cli.farm.frames import parse_frames

        try:
            return tuple(parse_frames(value))
        except UsageError as error:
            self.fail(str(error), param, ctx)


class Whole(click.IntRange):
    """A whole number, of a range where one is given."""

    name = "whole number"


class OneOf(click.ParamType):
    """One of some whole numbers."""

    name = "number"

    def __init__(self, choices: Sequence[int]) -> None:
        self.choices = tuple(choices)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        if str(value) not in map(str, self.choices):
            self.fail(f"{value!r} is not {' or '.join(map(str, self.choices))}", param, ctx)
        return int(value)


class Counts(click.ParamType):
    """`1,4,16` → the whole numbers above 0, each once, ascending."""

    name = "1,4,16"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...]:
        if not re.fullmatch(r"\s*[1-9]\d*\s*(,\s*[1-9]\d*\s*)*", value):
            self.fail(f"{value!r} is not a list of whole numbers above 0 such as 1,4,16", param, ctx)
        return tuple(sorted({int(number) for number in value.split(",")}))


class Ranks(Whole):
    """Ranks of a Cryptomatte, which stand two by two in its channels."""

    def __init__(self) -> None:
        from defshade_cli.image.layers.layer import MOST_RANKS

        super().__init__(2, MOST_RANKS)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        ranks = int(super().convert(value, param, ctx))
        if ranks % 2:
            self.fail(f"{ranks} is odd: ranks stand two by two", param, ctx)
        return ranks


class Amount(click.ParamType):
    """`GPU=1` → ("GPU", 1.0)."""

    name = "amount"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, float]:
        name, _, number = value.partition("=")
        if not name or not number:
            self.fail(f"{value!r} is no amount such as GPU=1", param, ctx)
        return name, Finite().convert(number, param, ctx)
