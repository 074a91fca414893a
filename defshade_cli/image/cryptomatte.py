"""Cryptomatte 1.2: which names cover a pixel, and how much of it.

A name's id is its MurmurHash3 read as a float. A pixel holds (id, coverage) pairs in ranks, the greatest coverage
first. Friedman & Jones 2015, "Fully Automatic ID Mattes with Support for Motion Blur and Transparency";
the specification: github.com/Psyop/Cryptomatte.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defshade_cli.dataclass import dataclass

_PIXELS_AT_ONCE = 1 << 18


def name_ids(names: Sequence[str]) -> NDArray[np.uint32]:
    """(N,) the bits of each name's id: its hash, no zero, denormal, infinity or NaN as a float."""
    bits = murmur3_32(names)
    exponent = bits >> 23 & 255
    return np.where((exponent == 0) | (exponent == 255), bits ^ np.uint32(1 << 23), bits)


def murmur3_32(texts: Sequence[str]) -> NDArray[np.uint32]:
    """(N,) MurmurHash3_x86_32 with seed 0 of texts in UTF-8, all at once. Austin Appleby, public domain."""
    encoded = [text.encode() for text in texts]
    lengths = np.array([len(text) for text in encoded], np.uint32)
    width = max(4, -(-int(lengths.max(initial=0)) // 4) * 4)
    blocks = np.array(encoded, f"S{width}").view("<u4").reshape(len(encoded), width // 4)
    h = np.zeros(len(encoded), np.uint32)
    for index, block in enumerate(blocks.T):
        mixed = h ^ _scrambled(block)
        rolled = _rotated(mixed, 13) * np.uint32(5) + np.uint32(0xE6546B64)
        left = lengths.astype(np.int64) - 4 * index
        h = np.where(left >= 4, rolled, np.where(left > 0, mixed, h))
    h ^= lengths
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        h = (h ^ h >> np.uint32(shift)) * np.uint32(factor)
    return h


def _scrambled(block: NDArray[np.uint32]) -> NDArray[np.uint32]:
    return _rotated(block * np.uint32(0xCC9E2D51), 15) * np.uint32(0x1B873593)


def _rotated(x: NDArray[np.uint32], by: int) -> NDArray[np.uint32]:
    return x << np.uint32(by) | x >> np.uint32(32 - by)


def cryptomatte_header(layer: str, names: Mapping[int, str]) -> dict[str, str]:
    """The attributes of a layer such as CryptoObject; names: by the bits of their ids."""
    prefix = f"cryptomatte/{murmur3_32([layer])[0]:08x}"[: len("cryptomatte/") + 7]
    manifest = {name: f"{bits:08x}" for bits, name in names.items()}
    return {
        f"{prefix}/name": layer,
        f"{prefix}/hash": "MurmurHash3_32",
        f"{prefix}/conversion": "uint32_to_float32",
        f"{prefix}/manifest": json.dumps(manifest, ensure_ascii=False, separators=(",", ":")),
    }


def read_manifests(header: Mapping[str, Any]) -> dict[str, dict[int, str]]:
    """Of a file's attributes: the layers' names as they have them → names by the bits of their ids."""
    keys = [key.rpartition("/")[0] for key in header if key.startswith("cryptomatte/") and key.endswith("/name")]
    manifests = {header[f"{key}/name"]: json.loads(header.get(f"{key}/manifest", "{}")) for key in keys}
    return {layer: {int(bits, 16): name for name, bits in names.items()} for layer, names in manifests.items()}


@dataclass(frozen=True, slots=True, eq=False)
class _Slot:
    """One number at most for each of P pixels, and how many samples had it. number: −1 for none yet."""

    number: NDArray[np.int32]
    count: NDArray[np.uint32]


class Coverage:
    """Counts which numbers the samples of each pixel show.

    Each pixel has a few slots, which are made as pixels need them: memory is bounded by `most` of them, and what a
    pixel shows beyond that many different numbers is not counted.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._slots: list[_Slot] = []

    def add(self, numbers: NDArray[np.int32]) -> None:
        """One sample: (P,) numbers, negative where nothing is seen."""
        seen = numbers >= 0
        if self._slots:  # most pixels show what they showed first
            again = seen & (self._slots[0].number == numbers)
            self._slots[0].count[...] += again
            seen &= ~again
        left = np.flatnonzero(seen)
        for slot in self._slots:
            left = _put(slot, left, numbers)
        while len(left) and len(self._slots) < self._most:
            self._slots.append(_Slot(np.full(len(numbers), -1, np.int32), np.zeros(len(numbers), np.uint32)))
            left = _put(self._slots[-1], left, numbers)

    def seen(self) -> NDArray[np.int32]:
        """The numbers (N,) that some pixel shows, ascending."""
        found = [np.unique(slot.number) for slot in self._slots]
        every = np.unique(np.concatenate([np.empty(0, np.int32), *found]))
        return every[every >= 0]

    def ranked(self, ids: NDArray[np.uint32], ranks: int, samples: int, pixels: int) -> NDArray[np.float32]:
        """(P, 2 · ranks) of (id, coverage) pairs; ids: (N,) the bits of each number's id."""
        result = np.zeros((pixels, ranks, 2), np.float32)
        values = np.append(ids, np.uint32(0)).view(np.float32)
        for first in range(0, pixels if self._slots else 0, _PIXELS_AT_ONCE):
            some = slice(first, first + _PIXELS_AT_ONCE)
            number = np.stack([slot.number[some] for slot in self._slots])
            count = np.stack([slot.count[some] for slot in self._slots])
            order = np.argsort(-count.astype(np.int64), axis=0, kind="stable")[:ranks]
            result[some, : len(order), 0] = values[np.take_along_axis(number, order, 0)].T
            result[some, : len(order), 1] = (np.take_along_axis(count, order, 0) / np.float64(samples)).T
        return result.reshape(pixels, 2 * ranks)


def _put(slot: _Slot, left: NDArray[np.intp], numbers: NDArray[np.int32]) -> NDArray[np.intp]:
    """Count the pixels `left` whose number the slot has or can take; those that remain."""
    have, want = slot.number[left], numbers[left]
    free = have < 0
    slot.number[left[free]] = want[free]
    counted = free | (have == want)
    slot.count[left[counted]] += 1
    return left[~counted]
