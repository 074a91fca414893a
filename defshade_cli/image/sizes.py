"""Pictures in smaller sizes."""

from __future__ import annotations

from math import inf

import numpy as np
import OpenImageIO as oiio

from defshade_cli.image.colour import Pixels


def fitted(colors: Pixels, width: float, height: float = inf, *, pixel_aspect: float = 1.0) -> Pixels:
    """The colours (H, W, 3) in [0, 1] reduced until they fit; what fits is returned as it is.

    pixel_aspect: height of a pixel of the result over its width.
    """
    rows, columns = colors.shape[:2]
    scale = min(1.0, width / columns, height * pixel_aspect / rows)
    size = (max(1, round(rows * scale / pixel_aspect)), max(1, round(columns * scale)))
    if size == (rows, columns):
        return np.array(colors, np.float32)
    source = oiio.ImageBuf(np.ascontiguousarray(colors, np.float32))
    smaller = oiio.ImageBufAlgo.resize(source, "triangle", 0.0, oiio.ROI(0, size[1], 0, size[0], 0, 1, 0, 3))
    return np.clip(np.asarray(smaller.get_pixels(oiio.FLOAT)), 0.0, 1.0)
