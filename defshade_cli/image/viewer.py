"""Images as one self-contained page: layers to switch, a slider for the exposure, the values under the pointer."""

from __future__ import annotations

import html
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from defshade_cli.image.appearing import write_text
from defshade_cli.image.colour import DisplayTransform, Pixels
from defshade_cli.image.inline import packed, png_address
from defshade_cli.image.look import Look, look_at
from defshade_cli.image.page import filled
from defshade_cli.image.stored import StoredImage

_TEMPLATE = Path(__file__).with_name("viewer.html")

_LATTICE = 49
_KNEE, _TOP = 256.0, 256.0
"""The lattice's axes are log2(1 + knee x): even steps below 1/knee, stops above it; what is over the top is clamped.

Against ACES 2.0 itself, for light from 2^-8 to 2^5: where channels differ up to threefold, 0.08 of 255 in the mean and
1.4 at most; any three channels, 0.14 and 17, at the sharp ends that the transform has for bright primaries.
"""

_LONGEST = 200
"""Characters of a fact that the page repeats."""


def write_viewer(
    shots: Sequence[tuple[StoredImage, tuple[str, ...], DisplayTransform]], path: Path, stops: float = 0.0
) -> None:
    """Write a page of images, each with the layers to show and how.

    stops: where the slider for the exposure stands at first. Raises OutputError.
    """
    images = [_image(*shot) for shot in shots]
    text = json.dumps({"images": images, "stops": stops}, separators=(",", ":")).replace("<", "\\u003c")
    title = ", ".join(image.path.name for image, _, _ in shots)
    write_text(path, filled(_TEMPLATE, title=html.escape(title), page=text))


def _image(image: StoredImage, names: tuple[str, ...], transform: DisplayTransform) -> dict[str, Any]:
    layers = [_layer(image, name, transform) for name in names]
    graded = any(layer["graded"] for layer in layers)
    return {
        "name": str(image.path),
        "size": image.size,
        "view": f"{transform.display} / {transform.view}" if graded else None,
        "lattice": _lattice(transform) if graded else None,
        "layers": layers,
        "facts": dict(_facts(image)),
    }


def _layer(image: StoredImage, name: str, transform: DisplayTransform) -> dict[str, Any]:
    """Colours are graded in the page, by the exposure; data have their look, and their values for the probe."""
    row, pixels = image.rows[name], image.layers[name]
    names = image.manifests.get(name, {})
    look = look_at(row, pixels, transform, names=names)
    return {
        "name": name,
        "channels": row.channels,
        "unit": row.unit,
        "background": row.background if isfinite(row.background) else None,
        "matte": row.source == "matte",
        "graded": row.is_color,
        "picture": None if row.is_color else png_address(look.colors),
        **_key(look),
        "names": names,
        "values": asdict(packed(pixels)),
    }


def _key(look: Look) -> dict[str, str | None]:
    return {"caption": look.caption, "legend": None if look.legend is None else png_address(look.legend)}


def _facts(image: StoredImage) -> Iterator[tuple[str, str]]:
    for name, value in image.facts.items():
        if name != "layers" and "/manifest" not in name and len(str(value)) <= _LONGEST:
            yield name, str(value)


def _lattice(transform: DisplayTransform) -> dict[str, Any]:
    """The display transform as a lattice of colours, which the page interpolates in tetrahedra."""
    axis = np.expm1(np.linspace(0.0, np.log1p(_KNEE * _TOP), _LATTICE)) / _KNEE
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).astype(np.float32)
    colors: Pixels = transform.apply(grid.reshape(_LATTICE, -1, 3)).astype(np.float16)
    return {"side": _LATTICE, "knee": _KNEE, "top": _TOP, **asdict(packed(colors))}
