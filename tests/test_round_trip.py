"""A frame with every layer, written, and read back by OpenImageIO and by the OpenEXR library."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from defshade_cli import render, resources
from defshade_cli.image.files import write
from defshade_cli.image.film import Film
from defshade_cli.image.layers import LAYERS
from defshade_cli.settings import OutputSettings

SIZE = (64, 36)
FAMILIES = ("light:Key", "light:default", "primvars:displayColor")

Channels = dict[str, NDArray]


@pytest.fixture(scope="module")
def film() -> Film:
    """Of a stage that moves, in two samples."""
    stage = resources.SCENES / "animated.usda"
    return render(stage, frame=10.0, size=SIZE, samples=2, layers=(*LAYERS, *FAMILIES))


def by_openimageio(path: Path) -> Channels:
    source, channels, part = oiio.ImageInput.open(str(path)), {}, 0
    while source.seek_subimage(part, 0):
        spec = source.spec()
        pixels = source.read_image(part, 0, 0, spec.nchannels, oiio.FLOAT)
        channels |= {name: pixels[..., i] for i, name in enumerate(spec.channelnames)}
        part += 1
    return channels


def by_openexr(path: Path) -> Channels:
    parts = pytest.importorskip("OpenEXR").File(str(path), separate_channels=True).parts
    return {name: channel.pixels for part in parts for name, channel in part.channels.items()}


@pytest.mark.parametrize("reader", [by_openimageio, by_openexr])
@pytest.mark.parametrize("options", [{"full_float": True}, {}, {"multipart": True}, {"compression": "piz"}])
def test_every_layer_reads_back_as_it_was_rendered(
    film: Film, reader: Callable[[Path], Channels], options: dict[str, object], tmp_path: Path
) -> None:
    """To the bit: colours as the half floats that they are kept in."""
    path = tmp_path / "frame.exr"
    write(film, OutputSettings(**options), path)  # type: ignore[arg-type]
    channels = reader(path)
    assert set(film.layers) == {*LAYERS, *FAMILIES}
    for name, values in film.layers.items():
        row = film.row(name)
        halves = row.is_color and not options.get("full_float")
        expected = values.astype(np.float16) if halves else values
        for channel, plane in zip(row.channel_names, np.moveaxis(expected, -1, 0), strict=True):
            np.testing.assert_array_equal(channels[channel].astype(np.float32), plane.astype(np.float32), channel)


def test_positions_return_to_their_pixels_by_the_header(film: Film, tmp_path: Path) -> None:
    """By worldToNDC as OpenEXR defines it, to a hundredth of a pixel; worldToCamera gives depth and distance."""
    path = tmp_path / "frame.exr"
    write(film, OutputSettings(), path)
    header = pytest.importorskip("OpenEXR").File(str(path)).header()
    channels = by_openexr(path)
    covered = np.isfinite(channels["depth.Z"])
    assert covered.mean() > 0.5
    points = np.column_stack([*(channels[f"position.{c}"][covered] for c in "XYZ"), np.ones(covered.sum())])
    ndc = points @ np.asarray(header["worldToNDC"], np.float64)
    rows, columns = np.nonzero(covered)
    found = ndc[:, :2] / ndc[:, 3:] * SIZE
    np.testing.assert_allclose(found, np.column_stack([columns, rows]) + 0.5, atol=0.01)
    in_camera = (points @ np.asarray(header["worldToCamera"], np.float64))[:, :3]
    np.testing.assert_allclose(channels["depth.Z"][covered], in_camera[:, 2], rtol=1e-5)
    np.testing.assert_allclose(channels["distance.Z"][covered], np.linalg.norm(in_camera, axis=1), rtol=1e-5)
