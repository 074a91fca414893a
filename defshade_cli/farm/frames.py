"""Frames from text: USD's FrameSpec, several of them between commas.

    12          one frame                   1:10        1, 2, … 10
    1:10x2      every second                10:1x-3     10, 7, 4, 1
    101:102x0.25   fractional frames        1:10x2,15   both, in this order

`openjd:1-10:2,15` is what Open Job Description's tasks name a chunk of frames, with its own meaning: 1 3 5 7 9 15.
`1-10` and `1-10x2` are read as `1:10` and `1:10x2`. `1-10:2` is refused, because what the colon steps over differs
between tools.
"""

from __future__ import annotations

import re
from decimal import Decimal

from defshade_cli.errors import UsageError

OPENJD = "openjd:"
"""Before a range expression of Open Job Description."""

MOST_FRAMES = 1_000_000

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
_SPEC = re.compile(rf"({_NUMBER})(?:(?::({_NUMBER})(?:x({_NUMBER}))?)|(?:-({_NUMBER})(?:x({_NUMBER}))?))?")
_OPENJD_RANGE = re.compile(r"(-?\d+)(?:-(-?\d+)(?::(-?\d+))?)?")
_DASHED = re.compile(rf"({_NUMBER})-({_NUMBER}):({_NUMBER})")


def parse_frames(text: str) -> tuple[float, ...]:
    """The frames that `text` names, in its order, each once.

    Steps are added in decimal, so `0:1x0.1` holds 0.3 and not 0.30000000000000004. Raises UsageError.
    """
    specs = [part.strip() for part in text.removeprefix(OPENJD).split(",")]
    if text.startswith(OPENJD):
        specs = [_from_openjd(spec) for spec in specs]
    frames = dict.fromkeys(frame for spec in specs for frame in _expand(spec))
    return tuple(frames)


def _expand(spec: str) -> list[float]:
    match = _SPEC.fullmatch(spec)
    if match is None:
        raise UsageError(_refusal(spec))
    start, colon_end, colon_stride, dash_end, dash_stride = match.groups()
    first = Decimal(start)
    last = Decimal(colon_end or dash_end or start)
    stride = Decimal(colon_stride or dash_stride or ("1" if last >= first else "-1"))
    if stride == 0:
        raise UsageError(f"frames '{spec}': a stride of 0 never arrives")
    if (last - first) * stride < 0:
        raise UsageError(f"frames '{spec}': the stride points away from the end; write {first}:{last}x{-stride}")
    count = int((last - first) / stride) + 1
    if count > MOST_FRAMES:
        raise UsageError(f"frames '{spec}': {count} frames; the limit is {MOST_FRAMES}")
    return [float(first + index * stride) + 0.0 for index in range(count)]


def _from_openjd(spec: str) -> str:
    """`1-10:2` → `1:10x2`."""
    match = _OPENJD_RANGE.fullmatch(spec)
    if match is None:
        raise UsageError(f"frames '{OPENJD}{spec}': write a frame (12), a range (1-10) or a stepped one (1-10:2)")
    first, last, step = match.groups()
    return first + (f":{last}" if last else "") + (f"x{step}" if step else "")


def _refusal(spec: str) -> str:
    dashed = _DASHED.fullmatch(spec)
    if dashed is None:
        return f"frames '{spec}': write a frame (12), a range (1:10), a stride (1:10x2), or several between commas"
    first, last, step = dashed.groups()
    return (
        f"frames '{spec}': '{first}-{last}:n' means other frames in other tools (OpenJD steps by n, "
        f"fileseq staggers); write {first}:{last}x{step}"
    )
