"""Where samples lie: Sobol's (0, 2)-sequence, Owen-scrambled anew for every pair of dimensions.

Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4): the index is shuffled and the coordinates are scrambled
with hashes, so that each pair is stratified at every power of two and the pairs know nothing of each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from defshade_cli.passes.filters import filter_offset
from defshade_cli.settings import Filter

Pair = tuple[float, float]


_MASK = 0xFFFFFFFF
_PIXEL, _TEXEL, _LENS, _LIGHTS = range(4)


@dataclass(frozen=True, slots=True)
class Sample:
    """One sample: its index, and places in unit squares: its pixel, a shadow map's texel, the lens.

    pixel: (0.5, 0.5) is the centre; a wide filter passes the pixel's edges.
    """

    index: int
    pixel: Pair
    texel: Pair
    lens: Pair

    @property
    def texel_offset(self) -> Pair:
        """From a texel's centre, in texels."""
        return self.texel[0] - 0.5, self.texel[1] - 0.5

    def on_light(self, number: int, k: int = 0, of: int = 1) -> Pair:
        """The k-th of some places on the number-th light."""
        return owen_sobol(self.index * of + k, _LIGHTS + number)


CENTRE = Sample(0, (0.5, 0.5), (0.5, 0.5), (0.5, 0.5))
"""The middle of everything: the only sample of a frame that has one, and the sample of data layers."""


def samples(count: int, kind: Filter = "box", width: float = 1.0) -> Iterator[Sample]:
    """`count` samples, spread over pixels by a filter; just the centre where one is asked."""
    if count == 1:
        yield CENTRE
        return
    for i in range(count):
        dx, dy = filter_offset(kind, width, owen_sobol(i, _PIXEL))
        yield Sample(i, (0.5 + dx, 0.5 + dy), owen_sobol(i, _TEXEL), owen_sobol(i, _LENS))


def owen_sobol(index: int, pattern: int) -> Pair:
    """Point `index` of one of 2^32 independent patterns, in [0, 1)²."""
    seed = _hash(pattern)
    x, y = _sobol(_scrambled(index, seed))
    return _scrambled(x, _hash(seed ^ 0x55555555)) / 2**32, _scrambled(y, _hash(seed ^ 0xAAAAAAAA)) / 2**32


def _sobol(index: int) -> tuple[int, int]:
    """The first two dimensions of Sobol's sequence as 32-bit fractions."""
    x, y, v, w = 0, 0, 1 << 31, 1 << 31
    while index:
        if index & 1:
            x, y = x ^ v, y ^ w
        index, v, w = index >> 1, v >> 1, w ^ w >> 1
    return x, y


def _scrambled(bits: int, seed: int) -> int:
    """Owen's nested uniform scramble of a 32-bit fraction, by Laine and Karras's hash on the reversed bits."""
    x = (_reversed(bits) + seed) & _MASK
    for constant in (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6):
        x ^= x * constant & _MASK
    return _reversed(x)


def _reversed(bits: int) -> int:
    return int(f"{bits:032b}"[::-1], 2)


def _hash(x: int) -> int:
    """Wellons 2018, "Prospecting for Hash Functions": lowbias32."""
    x = (x ^ x >> 16) * 0x7FEB352D & _MASK
    x = (x ^ x >> 15) * 0x846CA68B & _MASK
    return x ^ x >> 16
