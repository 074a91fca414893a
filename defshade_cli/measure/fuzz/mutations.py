"""One lie in the bytes of a file: any bytes, or text that is still text."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

Generator = np.random.Generator
Mutation = Callable[[bytes, Generator], bytes]

_TEXTS = {".usda", ".mtlx", ".ies"}
_IN_WORDS = 0.85
_NUMBER = re.compile(rb"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.])")
_WORD = re.compile(rb"""[\w:.]+|<[^>\n]*>|@[^@\n]*@|"[^"\n]*\"""")
_NUMBERS = (b"-1", b"0", b"2147483647", b"-2147483648", b"1e308", b"nan", b"inf", b"4294967295", b"1e-320", b"1e38")


def flipped(data: bytes, rng: Generator) -> bytes:
    """One to sixteen bits are others."""
    values = np.frombuffer(data, np.uint8).copy()
    for place in rng.integers(len(values), size=rng.integers(1, 17)):
        values[place] ^= 1 << rng.integers(8)
    return values.tobytes()


def truncated(data: bytes, rng: Generator) -> bytes:
    """The data cut off at a random byte."""
    return data[: rng.integers(len(data))]


def transplanted(data: bytes, rng: Generator) -> bytes:
    """A run of bytes stands in another place as well."""
    start, to = rng.integers(len(data), size=2)
    run = data[start : start + rng.integers(1, 256)]
    return data[:to] + run + data[to + len(run) :]


def renumbered(data: bytes, rng: Generator) -> bytes:
    """One to four numbers are extreme ones."""
    for _ in range(rng.integers(1, 5)):
        places = [found.span() for found in _NUMBER.finditer(data)]
        if places:
            start, end = places[rng.integers(len(places))]
            data = data[:start] + _NUMBERS[rng.integers(len(_NUMBERS))] + data[end:]
    return data


def reworded(data: bytes, rng: Generator) -> bytes:
    """A word, a path, a file or a string stands in the place of another of its kind: types, names, targets that lie."""
    words = [found.span() for found in _WORD.finditer(data)]
    if not words:
        return data
    start, end = words[rng.integers(len(words))]
    alike = [(first, last) for first, last in words if _kind(data[first]) == _kind(data[start])]
    first, last = alike[rng.integers(len(alike))]
    return data[:start] + data[first:last] + data[end:]


def _kind(byte: int) -> bytes:
    """What a word is, by its first byte."""
    sign = bytes((byte,))
    return sign if sign in b'<@"' else b"0" if sign.isdigit() else b"a"


def relined(data: bytes, rng: Generator) -> bytes:
    """A line is missing, or stands elsewhere as well."""
    lines = data.split(b"\n")
    line = int(rng.integers(len(lines)))
    if rng.random() < 0.5:
        return b"\n".join(lines[:line] + lines[line + 1 :])
    to = int(rng.integers(len(lines)))
    return b"\n".join([*lines[:to], lines[line], *lines[to:]])


ANYWHERE: tuple[Mutation, ...] = (flipped, truncated, transplanted)
IN_TEXT: tuple[Mutation, ...] = (renumbered, reworded, relined)


def mutated(data: bytes, suffix: str, rng: Generator) -> bytes:
    """The content of a file of that suffix with one lie. Of text most are lies in words, not in bytes."""
    chosen = IN_TEXT if suffix in _TEXTS and rng.random() < _IN_WORDS else ANYWHERE
    return chosen[rng.integers(len(chosen))](data, rng) if data else data
