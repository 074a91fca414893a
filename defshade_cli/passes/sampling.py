"""Where samples lie: Sobol's (0, 2)-sequence, Owen-scrambled anew for every pair of dimensions.

Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4): the index is shuffled and the coordinates are scrambled
with hashes, so that each pair is stratified at every power of two and the pairs know nothing of each other.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator
from functools import cache

from defshade_cli.dataclass import dataclass
from defshade_cli.passes.filters import filter_offset
from defshade_cli.passes.lattices import MOST_ON_LATTICE, Triple, even_grid, spiral
from defshade_cli.settings import Filter

Pair = tuple[float, float]
Lattice = Callable[[int, int], Triple]

_MASK = 0xFFFFFFFF
_PIXEL, _TEXEL, _LENS, _LIGHTS = range(4)


@dataclass(frozen=True, slots=True)
class Sample:
    """One sample: its index, and places in unit squares: its pixel, a shadow map's texel, the lens.

    pixel: (0.5, 0.5) is the centre; a wide filter passes the pixel's edges.
    cell: what the sample stands for of the pixel: from the sample to its middle, and its width and height, in pixels.
    among: samples whose points on a light may be chosen together; 0 where the first of them may be all that there are.
    """

    index: int
    pixel: Pair
    texel: Pair
    lens: Pair
    cell: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)
    among: int = 0

    @property
    def texel_offset(self) -> Pair:
        """From a texel's centre, in texels."""
        return self.texel[0] - 0.5, self.texel[1] - 0.5

    def on_light(self, number: int, k: int = 0, of: int = 1) -> Triple:
        """The k-th of some places on the number-th light; lights with a surface take the first two coordinates."""
        return spiral(k, of) if self is CENTRE else owen_sobol_3d(self.index * of + k, _LIGHTS + number)

    def on_round(self, number: int, k: int = 0, of: int = 1) -> Triple:
        """The same on a light that shines alike all over, to which a few samples bring a lattice together."""
        return self._together(spiral, number, k, of)

    def on_rectangle(self, number: int, k: int = 0, of: int = 1) -> Triple:
        """The same on one whose edges do not join, as those of a disk's angles do."""
        return self._together(even_grid, number, k, of)

    def _together(self, lattice: Lattice, number: int, k: int, of: int) -> Triple:
        if self is CENTRE:
            return lattice(k, of)
        count = self.among * of
        if not 0 < count <= MOST_ON_LATTICE:
            return self.on_light(number, k, of)
        return lattice(_order(count, _LIGHTS + number)[self.index * of + k], count)


CENTRE = Sample(0, (0.5, 0.5), (0.5, 0.5), (0.5, 0.5))
"""The middle of everything: the only sample of a frame that has one, and the sample of data layers."""


def samples(count: int, kind: Filter = "box", width: float = 1.0, *, may_stop: bool = False) -> Iterator[Sample]:
    """`count` samples, spread over pixels by a filter; just the centre where one is asked.

    may_stop: the first of them shall be as even as all.
    """
    if count == 1:
        yield CENTRE
        return
    for i in range(count):
        place = owen_sobol(i, _PIXEL)
        dx, dy = filter_offset(kind, width, place)
        (left, top), (right, bottom) = (filter_offset(kind, width, corner) for corner in _cell(place, count))
        cell = (0.5 * (left + right) - dx, 0.5 * (top + bottom) - dy, right - left, bottom - top)
        pixel = (0.5 + dx, 0.5 + dy)
        yield Sample(i, pixel, owen_sobol(i, _TEXEL), owen_sobol(i, _LENS), cell, 0 if may_stop else count)


def _cell(place: Pair, count: int) -> tuple[Pair, Pair]:
    """The corners of the part of the unit square that holds no other of the first 2^k of `count` points."""
    bits = count.bit_length() - 1
    columns, rows = 2 ** (bits - bits // 2), 2 ** (bits // 2)
    x, y = math.floor(place[0] * columns), math.floor(place[1] * rows)
    return (x / columns, y / rows), ((x + 1) / columns, (y + 1) / rows)


@cache
def _order(count: int, pattern: int) -> tuple[int, ...]:
    """Of a lattice's points: samples in a row are spread over it, and know nothing of where they lie in pixels."""
    places = [owen_sobol(i, pattern)[0] for i in range(count)]
    return tuple(bisect_left(sorted(places), place) for place in places)


def owen_sobol(index: int, pattern: int) -> Pair:
    """Point `index` of one of 2^32 independent patterns, in [0, 1)²."""
    return owen_sobol_3d(index, pattern)[:2]


def owen_sobol_3d(index: int, pattern: int) -> Triple:
    """The same in [0, 1)³; the first two coordinates are `owen_sobol`'s."""
    seed = _hash(pattern)
    x, y, z = _sobol(_scrambled(index, seed))
    keys = (_hash(seed ^ constant) for constant in (0x55555555, 0xAAAAAAAA, 0x33333333))
    a, b, c = (_scrambled(bits, key) / 2**32 for bits, key in zip((x, y, z), keys, strict=True))
    return a, b, c


def _sobol(index: int) -> tuple[int, int, int]:
    """The first three dimensions of Sobol's sequence as 32-bit fractions."""
    x = y = z = 0
    for column in _COLUMNS:
        if not index:
            break
        if index & 1:
            x, y, z = x ^ column[0], y ^ column[1], z ^ column[2]
        index >>= 1
    return x, y, z


def _columns() -> Iterator[tuple[int, int, int]]:
    """Of the generating matrices: identity, Pascal's triangle, and the primitive polynomial x² + x + 1."""
    x, y, z, after = 1 << 31, 1 << 31, 1 << 31, 3 << 30
    for _ in range(32):
        yield x, y, z
        x, y, z, after = x >> 1, y ^ y >> 1, after, after ^ z ^ z >> 2


_COLUMNS = tuple(_columns())


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
