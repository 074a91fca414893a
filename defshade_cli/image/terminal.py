"""Pictures as text that terminals draw: kitty's graphics, sixels, or half blocks where a terminal knows neither.

https://sw.kovidgoyal.net/kitty/graphics-protocol/, and DEC's VT330/VT340 Programmer Reference Manual, chapter 14.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from defshade_cli.image.colour import Pixels
from defshade_cli.image.inline import png, text

_CHUNK = 4096  # what kitty takes at a time
_LEVELS = (6, 7, 6)
"""Shades of red, green and blue among sixels' 256 colours."""

_BAYER = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]], np.float32) / 16.0 + 1.0 / 32.0
_RUN = re.compile(rb"(.)\1{3,}", re.DOTALL)


def kitty(colors: Pixels) -> str:
    """(H, W, 3) in [0, 1] as a PNG in kitty's graphics protocol."""
    content = text(png(colors))
    chunks = [content[start : start + _CHUNK] for start in range(0, len(content), _CHUNK)]
    keys = ["a=T,f=100,", *[""] * (len(chunks) - 1)]
    more = [*[1] * (len(chunks) - 1), 0]
    parts = zip(keys, more, chunks, strict=True)
    return "".join(f"\x1b_G{key}m={left};{chunk}\x1b\\" for key, left, chunk in parts) + "\n"


def blocks(colors: Pixels) -> str:
    """(H, W, 3) in [0, 1] as lines of ▀, each two pixels: the upper in its own colour, the lower behind it."""
    rows = colors if len(colors) % 2 == 0 else np.concatenate([colors, np.zeros_like(colors[:1])])
    upper, lower = (_codes(rows[first::2]) for first in (0, 1))
    cells = _joined("\x1b[38;2;", upper, ";48;2;", lower, "m▀")
    return "".join("".join(line) + "\x1b[0m\n" for line in cells)


def _codes(colors: Pixels) -> NDArray[np.str_]:
    """(H, W) each colour as `red;green;blue`."""
    digits = np.array([str(value) for value in range(256)])
    red, green, blue = (digits[channel] for channel in np.moveaxis(_bytes(colors), -1, 0))
    return _joined(red, ";", green, ";", blue)


def _joined(*parts: NDArray[np.str_] | str) -> NDArray[np.str_]:
    """Texts one behind the other, element by element."""
    return reduce(np.char.add, parts)  # type: ignore[arg-type]


def _bytes(colors: Pixels) -> NDArray[np.uint8]:
    return (np.clip(colors, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


def sixel(colors: Pixels) -> str:
    """(H, W, 3) in [0, 1] as sixels of 252 colours, dithered by Bayer's matrix."""
    height, width = colors.shape[:2]
    indices = _dithered(colors)
    padded = np.full((-height % 6 + height, width), -1, np.int16)
    padded[:height] = indices
    bands = "-".join("$".join(_band(band)) for band in padded.reshape(-1, 6, width))
    return f'\x1bP0;1q"1;1;{width};{height}{"".join(_palette())}{bands}\x1b\\\n'


def _dithered(colors: Pixels) -> NDArray[np.int16]:
    """(H, W) each pixel's number in the palette."""
    height, width = colors.shape[:2]
    steps = np.array(_LEVELS, np.float32) - 1.0
    thresholds = np.tile(_BAYER, (-(-height // 4), -(-width // 4)))[:height, :width, None]
    shade = np.minimum(np.floor(np.clip(colors, 0.0, 1.0) * steps + thresholds), steps).astype(np.int16)
    return (shade[..., 0] * _LEVELS[1] + shade[..., 1]) * _LEVELS[2] + shade[..., 2]


def _palette() -> Iterator[str]:
    """Each colour in percent."""
    for index, shade in enumerate(np.ndindex(_LEVELS)):
        red, green, blue = (round(100 * step / (levels - 1)) for step, levels in zip(shade, _LEVELS, strict=True))
        yield f"#{index};2;{red};{green};{blue}"


def _band(band: NDArray[np.int16]) -> Iterator[str]:
    """Six rows: for each of their colours the columns' bits, a letter a column, runs counted."""
    weights = np.array([1, 2, 4, 8, 16, 32], np.uint8)[:, None]
    for index in np.unique(band[band >= 0]):
        letters = ((band == index) * weights).sum(axis=0, dtype=np.uint8) + np.uint8(63)
        yield f"#{index}" + _RUN.sub(lambda run: b"!%d%c" % (len(run[0]), run[0][0]), letters.tobytes()).decode()
