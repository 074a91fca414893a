"""Where an image is below 1, told before any is loaded."""

from __future__ import annotations

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.image.packed import stamp
from defshade_cli.image.texture import opened, place_of
from defshade_cli.scene.texture import Channel, ImageFile

_CELLS = 512
"""A side, that are told apart at most."""

_MOST_KEPT = 128
"""Images that are remembered, of a megabyte each."""

_KNOWN: dict[tuple[str, int, Channel], NDArray[np.int32]] = {}


def below_one(file: ImageFile, channel: Channel) -> NDArray[np.int32]:
    """(H + 1, W + 1) how many cells below each row and left of each column hold a texel that is below 1.

    Row 0 is at the bottom; of a channel that stands for several the first counts. One cell where all are alike.
    Raises OSError for what cannot be read.
    """
    key = file.path, stamp(file), channel
    if key not in _KNOWN:
        while len(_KNOWN) >= _MOST_KEPT:
            _KNOWN.pop(next(iter(_KNOWN)))
        _KNOWN[key] = _summed(_looked_at(file, channel))
    return _KNOWN[key]


def _summed(cells: NDArray[np.bool_]) -> NDArray[np.int32]:
    sums = np.pad(cells, ((1, 0), (1, 0))).cumsum(axis=0, dtype=np.int32)
    return np.cumsum(sums, axis=1, dtype=np.int32, out=sums)


def _looked_at(file: ImageFile, channel: Channel) -> NDArray[np.bool_]:
    with opened(file) as image:
        spec = image.spec()
        at = place_of(channel[0], spec.nchannels)
        if at is None:
            return np.zeros((1, 1), bool)
        kind, one = (oiio.UINT8, 255) if spec.format == oiio.UINT8 else (oiio.FLOAT, 1.0)
        texels = image.read_image(0, 0, at, at + 1, kind)
        if texels is None:
            raise OSError(image.geterror())
    below = ~(texels[::-1, :, 0] >= one)
    return _in_cells(below) if below.any() and not below.all() else below[:1, :1]


def _in_cells(below: NDArray[np.bool_]) -> NDArray[np.bool_]:
    size = -(-max(below.shape) // _CELLS)
    rows, columns = (np.arange(0, side, size) for side in below.shape)
    return np.logical_or.reduceat(np.logical_or.reduceat(below, rows, axis=0), columns, axis=1)
