"""What the terminal can draw, by its own word."""

from __future__ import annotations

import fcntl
import os
import re
import select
import struct
import sys
import termios
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

from defshade_cli.dataclass import dataclass

Form = Literal["kitty", "sixel", "blocks"]

_QUESTION = b"\x1b_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\x1b\\" + b"\x1b[c"
"""kitty's query, and then the one that every terminal answers: its device attributes, 4 of which is sixels."""

_ATTRIBUTES = re.compile(rb"\x1b\[\?([\d;]*)c")
_PATIENCE = 1.0  # seconds: a terminal at the far end of a slow line
_CELL = (10, 20)
"""Pixels of a character where a terminal does not tell."""


@dataclass(frozen=True, slots=True)
class Screen:
    """columns, rows: in characters.  cell: (width, height) of a character in pixels."""

    columns: int
    rows: int
    cell: tuple[int, int]


def measure(descriptor: int | None) -> Screen:
    """The size of the terminal at a file descriptor; 80 by 24 where there is none."""
    if descriptor is None:
        return Screen(80, 24, _CELL)
    try:
        rows, columns, width, height = struct.unpack("HHHH", fcntl.ioctl(descriptor, termios.TIOCGWINSZ, b"\0" * 8))
    except OSError:
        rows = columns = width = height = 0
    columns, rows = columns or 80, rows or 24
    cell = (width // columns, height // rows) if width and height else _CELL
    return Screen(columns, rows, cell)


def best_form(descriptor: int, patience: float = _PATIENCE) -> Form:
    """The best that the terminal at a file descriptor says it can draw; `blocks` where it does not answer.

    patience: seconds to wait for an answer.
    """
    if not os.isatty(descriptor) or os.environ.get("TERM") == "dumb":
        return "blocks"
    with _unbuffered(descriptor):
        os.write(descriptor, _QUESTION)
        answer = _answer(descriptor, patience)
    attributes = _ATTRIBUTES.search(answer)
    if b"\x1b_Gi=31;OK" in answer:
        return "kitty"
    return "sixel" if attributes and b"4" in attributes[1].split(b";")[1:] else "blocks"


def controlling_terminal() -> int | None:
    """A file descriptor of the terminal that the user sits at, where standard output is one."""
    if not sys.stdout.isatty():
        return None
    try:
        return os.open(os.ctermid(), os.O_RDWR | os.O_NOCTTY)
    except OSError:
        return None


@contextmanager
def _unbuffered(descriptor: int) -> Iterator[None]:
    """Answers come at once, and are not shown."""
    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor, termios.TCSANOW)
        yield
    finally:
        termios.tcsetattr(descriptor, termios.TCSANOW, before)


def _answer(descriptor: int, patience: float) -> bytes:
    """What the terminal sends up to its device attributes, which it sends last."""
    answer, end = b"", time.monotonic() + patience
    while not _ATTRIBUTES.search(answer):
        readable, _, _ = select.select([descriptor], [], [], max(0.0, end - time.monotonic()))
        if not readable:
            break
        answer += os.read(descriptor, 1024)
    return answer
