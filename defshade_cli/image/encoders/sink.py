"""What all encoders share: an open file of OpenImageIO's, its header and pixels that it can hold."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from defshade_cli.image.colour import BRIGHTEST, Pixels
from defshade_cli.image.film import Film
from defshade_cli.image.metadata import Attribute

log = logging.getLogger("defshade")


def make_spec(film: Film, channels: int, kind: str) -> oiio.ImageSpec:
    """A spec with the film's data window in its display window. kind: OpenImageIO's channel type."""
    spec = oiio.ImageSpec(*film.size, channels, kind)
    spec.x, spec.y = film.origin
    spec.full_width, spec.full_height = film.display_size
    return spec


def set_attributes(spec: oiio.ImageSpec, attributes: Iterable[Attribute]) -> None:
    """Put attributes into a header, each with its type."""
    for name, kind, value in attributes:
        spec.attribute(name, oiio.TypeDesc(kind), value)


@contextmanager
def opened(path: Path, specs: Sequence[oiio.ImageSpec]) -> Iterator[oiio.ImageOutput]:
    """An open encoder. Some report a failure through the message alone, so that is asked at the end: OSError."""
    encoder = oiio.ImageOutput.create(str(path))
    if encoder is None:
        raise OSError(oiio.geterror())
    if encoder.open(str(path), specs[0]) if len(specs) == 1 else encoder.open(str(path), tuple(specs)):
        yield encoder
        encoder.close()
    if reason := encoder.geterror():
        raise OSError(reason)


def bounded(name: str, pixels: Pixels, *, half: bool) -> Pixels:
    """The pixels (H, W, C), brought within what half can hold where asked; what is wrong with them goes to the log."""
    low, high = pixels.min(), pixels.max()
    if np.isnan(low):
        log.warning("%s: %d values are NaN", name, np.count_nonzero(np.isnan(pixels)))
    if not half or (low >= -BRIGHTEST and high <= BRIGHTEST):
        return pixels
    if beyond := np.count_nonzero(np.abs(pixels) > BRIGHTEST):
        log.warning("%s: %d values beyond half's %g are clamped", name, beyond, BRIGHTEST)
    return np.clip(pixels, -BRIGHTEST, BRIGHTEST)
