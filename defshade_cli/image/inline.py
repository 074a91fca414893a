"""Pictures and floats inside a text: a page's `data:` addresses, and what a terminal takes."""

from __future__ import annotations

import base64
import tempfile
import zlib
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from defshade_cli.dataclass import dataclass
from defshade_cli.image.colour import Pixels


def png(colors: Pixels) -> bytes:
    """A PNG file of colours (H, W, 1 or 3) in [0, 1]."""
    return _file(colors, ".png", "")


def jpeg_address(colors: Pixels) -> str:
    """The `data:` address of a JPEG of colours (H, W, 1 or 3) in [0, 1]."""
    return "data:image/jpeg;base64," + text(_file(colors, ".jpg", "jpeg:85"))


def png_address(colors: Pixels) -> str:
    """The `data:` address of a PNG of colours (H, W, 1 or 3) in [0, 1]."""
    return "data:image/png;base64," + text(png(colors))


def text(content: bytes) -> str:
    """Bytes as base64."""
    return base64.b64encode(content).decode()


@dataclass(frozen=True, slots=True)
class Packed:
    """Numbers, without loss.

    size: bytes of each, 2 for halves and 4 for floats.  data: base64, of what `packed` says.
    """

    size: int
    data: str


def packed(pixels: Pixels) -> Packed:
    """Pixels (H, W, C): half floats where they hold all of it, else floats.

    Channel after channel; of each kind of byte first all, then those of the next kind; each less the one before,
    which makes smooth pictures small numbers; then zlib. OpenEXR's ZIP does alike.
    """
    planes = np.ascontiguousarray(np.moveaxis(pixels, -1, 0), np.float32)
    with np.errstate(over="ignore"):
        halves = planes.astype(np.float16)
    exact = np.array_equal(halves.astype(np.float32), planes, equal_nan=True)
    size = 2 if exact else 4
    split = (halves if exact else planes).reshape(-1).view(np.uint8).reshape(-1, size).T.reshape(-1)
    return Packed(size, text(zlib.compress(np.diff(split, prepend=np.uint8(0)).tobytes())))


def _file(colors: Pixels, suffix: str, compression: str) -> bytes:
    channels = 3 if colors.shape[2] >= 3 else 1
    with tempfile.NamedTemporaryFile(suffix=suffix) as file:
        buffer = oiio.ImageBuf(np.ascontiguousarray(colors[..., :channels], np.float32))
        if compression:
            buffer.specmod().attribute("compression", compression)
        buffer.write(file.name, "uint8")
        return Path(file.name).read_bytes()
