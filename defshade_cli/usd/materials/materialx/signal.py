"""What a MaterialX network computes, as far as a texture input can say it: a constant, or a texel scaled and biased."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.texture import IDENTITY, Affine, Texture

Values = NDArray[np.float64]


class NonLinear(Exception):
    """An operation that no scale and bias of one texel can stand for."""


class Lookup(NamedTuple):
    """An image at texture_from_uv · (u, v, 1) of the primvar `uv`."""

    texture: Texture
    uv: str
    texture_from_uv: Affine = IDENTITY


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """Channel i is texel[sources[i]] · scale[i] + bias[i]; without a lookup it is bias[i] alone.

    bias, scale: (C,) float64, C from 1 to 4.
    """

    bias: Values
    scale: Values
    sources: tuple[int, ...]
    lookup: Lookup | None = None

    @property
    def is_constant(self) -> bool:
        """Whether no image is read."""
        return self.lookup is None

    @property
    def width(self) -> int:
        """How many channels it has."""
        return len(self.bias)

    def __add__(self, other: Signal) -> Signal:
        a, b = _matched(self, other)
        if a.is_constant or b.is_constant:
            return replace(b if a.is_constant else a, bias=a.bias + b.bias)
        if a.lookup == b.lookup and a.sources == b.sources:
            return replace(a, scale=a.scale + b.scale, bias=a.bias + b.bias)
        raise NonLinear

    def __mul__(self, other: Signal) -> Signal:
        a, b = _matched(self, other)
        if b.is_constant:
            a, b = b, a
        if not a.is_constant:
            raise NonLinear
        return replace(b, scale=b.scale * a.bias, bias=b.bias * a.bias).simplified()

    def __sub__(self, other: Signal) -> Signal:
        return self + other * constant(-1.0)

    def __truediv__(self, other: Signal) -> Signal:
        if not other.is_constant:
            raise NonLinear
        with np.errstate(divide="ignore", invalid="ignore"):
            return self * constant(np.nan_to_num(1.0 / other.bias, posinf=0.0, neginf=0.0))

    def pick(self, channels: Sequence[int]) -> Signal:
        """Those channels, in that order; the last stands in for those beyond it."""
        found = [min(channel, self.width - 1) for channel in channels]
        sources = tuple(self.sources[channel] for channel in found)
        return replace(self, bias=self.bias[found], scale=self.scale[found], sources=sources)

    def widened(self, width: int) -> Signal:
        """With `width` channels: a single one repeats, an alpha that is missing is 1, those beyond are cut."""
        if self.width == 3 and width == 4:
            return joined([self, constant(1.0)])
        return self.pick(range(width)) if self.width != width else self

    def simplified(self) -> Signal:
        """A constant where the texel no longer counts."""
        return self if self.scale.any() else constant(self.bias)


def constant(values: ArrayLike) -> Signal:
    """A signal that is the same everywhere; values: a number or (C,)."""
    bias = np.atleast_1d(np.asarray(values, np.float64))
    return Signal(bias, np.zeros_like(bias), (0,) * len(bias))


def texel(lookup: Lookup, width: int) -> Signal:
    """The first `width` channels of an image as they are."""
    return Signal(np.zeros(width), np.ones(width), tuple(range(width)), lookup)


def joined(signals: Sequence[Signal]) -> Signal:
    """Their channels one after another. Raises NonLinear where they read different images."""
    lookups = {signal.lookup for signal in signals if signal.lookup}
    if len(lookups) > 1:
        raise NonLinear
    bias, scale = (np.concatenate([getattr(signal, name) for signal in signals]) for name in ("bias", "scale"))
    sources = tuple(source for signal in signals for source in signal.sources)
    return Signal(bias, scale, sources, next(iter(lookups), None))


def mixed(background: Signal, foreground: Signal, amount: Signal) -> Signal:
    """MaterialX's `mix`: background where `amount` is 0, foreground where it is 1."""
    return background * (constant(1.0) - amount) + foreground * amount


def _matched(a: Signal, b: Signal) -> tuple[Signal, Signal]:
    width = max(a.width, b.width)
    return a.widened(width), b.widened(width)


def by_values(function: Callable[..., Values], *operands: Signal) -> Signal:
    """A function of constants. Raises NonLinear for anything else."""
    if not all(operand.is_constant for operand in operands):
        raise NonLinear
    with np.errstate(all="ignore"):
        return constant(np.nan_to_num(function(*(operand.bias for operand in operands))))
