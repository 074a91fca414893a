"""IES profiles: luminous intensity by direction, from files of ANSI/IES LM-63 (1986, 1991, 1995, 2002, 2019).

Type C, the usual one, counts vertical angles from the photometric axis, 0° to 180°, and horizontal ones around it.
Symmetric files stop at 0°, 90° or 180°; here they are unfolded to 360°. Types A and B count latitudes and longitudes
about an axis across the photometric one; they are resampled to type C.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cached_property, lru_cache
from itertools import islice

import numpy as np
from numpy.typing import ArrayLike, NDArray

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.arrays import frozen

_TYPES = {1: "C", 2: "B", 3: "A"}
_SEPARATORS = re.compile(r"[\s,]+")
_MOST_VALUES = 4_000_000
_STEP = 2.5  # degrees between the directions that types A and B are resampled to


class IesError(ValueError):
    """A profile that cannot be read; its text says why in a few words."""


@dataclass(frozen=True, eq=False)
class IesProfile:
    """vertical: (V,) degrees off the axis, ascending.  horizontal: (H,) degrees around it, 0 to 360, ascending.

    candela: (H, V) float64, the file's factors multiplied in.
    """

    vertical: NDArray[np.float64]
    horizontal: NDArray[np.float64]
    candela: NDArray[np.float64]

    def __post_init__(self) -> None:
        shape = len(self.horizontal), len(self.vertical)
        object.__setattr__(self, "vertical", frozen(self.vertical, np.float64, shape[1]))
        object.__setattr__(self, "horizontal", frozen(self.horizontal, np.float64, shape[0]))
        object.__setattr__(self, "candela", frozen(self.candela, np.float64, *shape))

    def at(self, vertical: ArrayLike, horizontal: ArrayLike) -> NDArray[np.float64]:
        """Bilinear between the file's angles, degrees in any shape; 0 at verticals that the file leaves out."""
        v, h = np.broadcast_arrays(np.asarray(vertical, np.float64), np.asarray(horizontal, np.float64) % 360.0)
        i, s = _interval(self.vertical, v)
        j, t = _interval(self.horizontal, h)
        rows = [(1.0 - s) * self.candela[k, i] + s * self.candela[k, i + 1] for k in (j, j + 1)]
        inside = (v >= self.vertical[0]) & (v <= self.vertical[-1])
        return np.where(inside, (1.0 - t) * rows[0] + t * rows[1], 0.0)

    @property
    def peak(self) -> float:
        """Candela, the greatest of all directions."""
        return float(self.candela.max())

    @cached_property
    def mean(self) -> float:
        """Average over the hemisphere, or the sphere, that the file's vertical angles span.

        The power that shaping:ies:normalize divides by, as Karma and RenderMan have it.
        """
        span = 4.0 * np.pi if np.ptp(self.vertical) > 95.0 else 2.0 * np.pi
        return self._flux / span

    @property
    def _flux(self) -> float:
        """∫ candela dω, exact for values linear in both angles."""
        a, b = np.radians(self.vertical[:-1]), np.radians(self.vertical[1:])
        whole = np.cos(a) - np.cos(b)
        upper = (np.sin(b) - np.sin(a)) / (b - a) - np.cos(b)  # ∫ (θ − a) / (b − a) sinθ dθ
        rings = self.candela[:, :-1] * (whole - upper) + self.candela[:, 1:] * upper
        around = np.radians(np.diff(self.horizontal))
        return float(around @ (rings[:-1] + rings[1:]).sum(axis=1) / 2.0)


@lru_cache(maxsize=64)
def parse_ies(text: str) -> IesProfile:
    """The profile in a file's text. Raises IesError."""
    head, found, tail = _split_at_tilt(text)
    if not found:
        raise IesError("it has no TILT line")
    numbers = _numbers(tail)
    if head.upper() == "INCLUDE":
        _, count = _take(numbers, 2, "tilt")
        _take(numbers, 2 * _counted(count, "tilt angles"), "tilt")
    _, _, multiplier, verticals, horizontals, kind, *_ = _take(numbers, 10, "header")
    ballast, lamp, _ = _take(numbers, 3, "header")
    rows, columns = _counted(horizontals, "horizontal angles"), _counted(verticals, "vertical angles")
    vertical = _ascending(_take(numbers, columns, "vertical angles"), "vertical")
    horizontal = _ascending(_take(numbers, rows, "horizontal angles"), "horizontal")
    candela = _take(numbers, rows * columns, "candela values").reshape(rows, columns)
    if kind not in _TYPES:
        raise IesError(f"its photometric type is {kind:g}")
    factor = multiplier * (ballast or 1.0) * (lamp or 1.0)
    values = np.maximum(candela * factor, 0.0)
    if _TYPES[int(kind)] == "C":
        return _unfolded(vertical, horizontal, values)
    return _resampled(vertical, horizontal, values, _TYPES[int(kind)])


def _split_at_tilt(text: str) -> tuple[str, bool, str]:
    """What TILT says, whether there is such a line, and all that follows it."""
    match = re.search(r"^[ \t]*TILT[ \t]*=[ \t]*(.*?)[ \t]*$", text, re.MULTILINE | re.IGNORECASE)
    return (match[1], True, text[match.end() :]) if match else ("", False, "")


def _numbers(text: str) -> Iterator[float]:
    for word in filter(None, _SEPARATORS.split(text)):
        try:
            yield float(word)
        except ValueError:
            raise IesError(f"{word[:20]!r} stands where a number should") from None


def _take(numbers: Iterator[float], count: int, what: str) -> NDArray[np.float64]:
    taken = np.fromiter(islice(numbers, count), np.float64)
    if len(taken) < count:
        raise IesError(f"it ends amid its {what}")
    if not np.isfinite(taken).all():
        raise IesError(f"its {what} are not finite")
    return taken


def _counted(value: float, what: str) -> int:
    if not 1 <= value <= _MOST_VALUES or value != int(value):
        raise IesError(f"it has {value:g} {what}")
    return int(value)


def _ascending(angles: NDArray[np.float64], what: str) -> NDArray[np.float64]:
    if (np.diff(angles) <= 0.0).any():
        raise IesError(f"its {what} angles do not ascend")
    return angles


def _unfolded(
    vertical: NDArray[np.float64], horizontal: NDArray[np.float64], candela: NDArray[np.float64]
) -> IesProfile:
    """All around, by the symmetry that the range of a type C file's horizontal angles stands for."""
    first, last = horizontal[0], horizontal[-1]
    if len(vertical) == 1:
        raise IesError("it has one vertical angle")
    if len(horizontal) == 1:
        return IesProfile(vertical, np.array([0.0, 360.0]), np.repeat(candela, 2, axis=0))
    if (first, last) == (90.0, 270.0):
        return _mirrored(vertical, horizontal, candela)
    if first != 0.0 or last not in (90.0, 180.0, 360.0):
        raise IesError(f"its horizontal angles go from {first:g} to {last:g}")
    while last < 360.0:
        horizontal = np.concatenate([horizontal, 2.0 * last - horizontal[-2::-1]])
        candela = np.concatenate([candela, candela[-2::-1]])
        last *= 2.0
    return IesProfile(vertical, horizontal, candela)


def _mirrored(
    vertical: NDArray[np.float64], horizontal: NDArray[np.float64], candela: NDArray[np.float64]
) -> IesProfile:
    """All around from 90° to 270°: the plane through both is the mirror."""
    near, far = horizontal <= 180.0, horizontal >= 180.0
    around = [180.0 - horizontal[near][::-1], horizontal[1:], 540.0 - horizontal[far][-2::-1]]
    rows = [candela[near][::-1], candela[1:], candela[far][-2::-1]]
    return IesProfile(vertical, np.concatenate(around), np.concatenate(rows))


def _resampled(
    latitude: NDArray[np.float64], longitude: NDArray[np.float64], candela: NDArray[np.float64], kind: str
) -> IesProfile:
    """Types A (vertical angles are latitudes) and B (horizontal ones are); a range from 0° stands for both sides."""
    if min(len(latitude), len(longitude)) == 1:
        raise IesError(f"it is of type {kind} and has one angle")
    vertical, horizontal = np.arange(0.0, 180.0 + _STEP, _STEP), np.arange(0.0, 360.0 + _STEP, _STEP)
    around, off = np.radians(horizontal)[:, None], np.radians(vertical)[None, :]
    x, y = np.sin(off) * np.cos(around), np.sin(off) * np.sin(around)
    z = np.cos(off) * np.ones_like(around)
    if kind == "A":
        h, v = np.arctan2(x, z), np.arcsin(np.clip(y, -1.0, 1.0))
    else:
        h, v = np.arcsin(np.clip(x, -1.0, 1.0)), np.arctan2(y, z)
    h, v = np.degrees(h), np.degrees(v)
    h = np.abs(h) if longitude[0] == 0.0 else h
    v = np.abs(v) if latitude[0] == 0.0 else v
    i, s = _interval(latitude, v)
    j, t = _interval(longitude, h)
    values = [(1.0 - s) * candela[k, i] + s * candela[k, i + 1] for k in (j, j + 1)]
    inside = (v >= latitude[0]) & (v <= latitude[-1]) & (h >= longitude[0]) & (h <= longitude[-1])
    return IesProfile(vertical, horizontal, np.where(inside, (1.0 - t) * values[0] + t * values[1], 0.0))


def _interval(edges: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """The interval between edges that each value is in, and how far, in [0, 1]."""
    index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    return index, np.clip((values - edges[index]) / (edges[index + 1] - edges[index]), 0.0, 1.0)
