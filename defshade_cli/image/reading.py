"""Image files → layers, whoever wrote them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from defshade_cli.errors import OutputError
from defshade_cli.image.colour import Pixels
from defshade_cli.image.layers import BEAUTY, MAIN_PART, layer_in_file
from defshade_cli.image.metadata import read_provenance


def read(path: Path, *, data_window: bool = False) -> dict[str, Pixels]:
    """Layer → (H, W, C) float32 of an image file, whoever wrote it; pictures stay display-encoded in [0, 1].

    Channels without a layer are the beauty, Z alone the depth; a further part of a multi-part EXR gives its name.
    A cropped data window is filled up with zeros, unless the `data_window` alone is wanted. Raises OutputError.
    """
    layers: dict[str, Pixels] = {}
    for spec, stored in parts(path):
        pixels = stored if data_window else uncropped(spec, stored)
        for name, channels in grouped(spec).items():
            layers.setdefault(name, np.take(pixels, channels, axis=-1))
    return layers


def read_header(path: Path) -> dict[str, Any]:
    """The provenance that `write` left in a file: scene, frame, samples and the film's metadata. Raises OutputError."""
    source = _open(path)
    return read_provenance((entry.name, entry.value) for entry in source.spec().extra_attribs)


def _open(path: Path) -> oiio.ImageInput:
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), config)
    if source is None:
        reason = oiio.geterror()  # else told when the process ends
        raise OutputError(f"{path}: cannot be read: {reason}" if path.exists() else f"no such file: {path}")
    return source


def parts(path: Path) -> Iterator[tuple[oiio.ImageSpec, NDArray[Any]]]:
    """Every part's header and its pixels (H, W, C) float32, of its data window. Raises OutputError."""
    source = _open(path)
    part = 0
    while source.seek_subimage(part, 0):
        spec = source.spec()
        pixels = source.read_image(part, 0, 0, spec.nchannels, oiio.FLOAT)
        if pixels is None:
            raise OutputError(f"{path}: cannot be read: {source.geterror()}")
        yield spec, pixels
        part += 1


def uncropped(spec: oiio.ImageSpec, pixels: NDArray[Any]) -> NDArray[Any]:
    """The pixels (H, W, C) of a data window in the display window of its header, zeros around them."""
    whole = (spec.full_height, spec.full_width)
    top, left = spec.y - spec.full_y, spec.x - spec.full_x
    if (top, left) == (0, 0) and pixels.shape[:2] == whole:
        return pixels
    canvas = np.zeros((*whole, pixels.shape[2]), pixels.dtype)
    rows, columns = slice(max(top, 0), top + spec.height), slice(max(left, 0), left + spec.width)
    inside = canvas[rows, columns]
    inside[...] = pixels[max(-top, 0) :, max(-left, 0) :][: inside.shape[0], : inside.shape[1]]
    return canvas


def grouped(spec: oiio.ImageSpec) -> dict[str, list[int]]:
    """Layer → indices of its channels."""
    part = spec.get_string_attribute("oiio:subimagename")
    part = BEAUTY if part == MAIN_PART else part
    groups: dict[str, list[int]] = {}
    for index, channel in enumerate(spec.channelnames):
        prefix = channel.rpartition(".")[0]
        layer = layer_in_file(prefix) if prefix else part or ("depth" if channel == "Z" else BEAUTY)
        groups.setdefault(layer, []).append(index)
    return groups
