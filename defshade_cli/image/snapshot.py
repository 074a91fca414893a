"""A picture that is display-ready already, written as it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from defshade_cli.errors import OutputError
from defshade_cli.image.colour import Pixels


def write_snapshot(pixels: Pixels, path: Path) -> None:
    """(H, W, 3) in [0, 1] → 8 bits, in the format of the suffix; folders are made. Raises OutputError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    image = oiio.ImageBuf(np.ascontiguousarray(pixels, np.float32))
    image.specmod().attribute("compression", "lossless")
    if not image.write(str(path), "uint8"):
        raise OutputError(f"{path}: cannot be written: {image.geterror()}")
