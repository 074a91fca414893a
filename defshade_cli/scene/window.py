"""The data window: the part of an image that is rendered, in whole or beyond it."""

from __future__ import annotations

from math import ceil, isfinite

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import UsageError
from defshade_cli.spaces import Window

WHOLE_IMAGE = (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class DataWindow:
    """Pixels from (x, y) on, counted from the top left corner of the display window, which they may leave.

    x, y: of the first pixel, y down.  width, height: in pixels.
    """

    x: int
    y: int
    width: int
    height: int

    def __post_init__(self) -> None:
        if min(self.width, self.height) < 1:
            raise UsageError(f"a data window of {self.width}x{self.height} has no pixels")

    @property
    def origin(self) -> tuple[int, int]:
        """(x, y) of the upper left pixel."""
        return self.x, self.y

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        return self.width, self.height

    def tiles(self, side: int) -> list[DataWindow]:
        """The same pixels in windows of at most `side` pixels a side, row by row."""
        return [
            DataWindow(x, y, min(side, self.x + self.width - x), min(side, self.y + self.height - y))
            for y in range(self.y, self.y + self.height, side)
            for x in range(self.x, self.x + self.width, side)
        ]

    def of(self, window: Window, display: tuple[int, int]) -> Window:
        """The part of a camera's (left, right, bottom, top) that these pixels of a `display` see."""
        left, right, bottom, top = window
        across, down = (right - left) / display[0], (top - bottom) / display[1]
        return (
            left + self.x * across,
            left + (self.x + self.width) * across,
            top - (self.y + self.height) * down,
            top - self.y * down,
        )


def from_ndc(ndc: tuple[float, float, float, float], display: tuple[int, int]) -> DataWindow:
    """The pixels whose centres lie in (xmin, ymin, xmax, ymax), 0..1 over the display window, y up.

    UsdRenderSettingsBase, dataWindowNDC. Fractions, since a centre on the border is in or out as the numbers say.
    Raises UsageError where there are none, or where a border is not finite.
    """
    if not all(isfinite(border) for border in ndc):
        raise UsageError(f"a data window of {ndc} has no pixels")
    if ndc == WHOLE_IMAGE:
        return DataWindow(0, 0, *display)
    from fractions import Fraction

    xmin, ymin, xmax, ymax = (Fraction(value) for value in ndc)
    columns = [ceil(x * display[0] - Fraction(1, 2)) for x in (xmin, xmax)]
    rows = [ceil((1 - y) * display[1] - Fraction(1, 2)) for y in (ymax, ymin)]
    return DataWindow(columns[0], rows[0], columns[1] - columns[0], rows[1] - rows[0])
