"""Image files with what their headers say of each layer, whoever wrote them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from defshade_cli.dataclass import dataclass
from defshade_cli.errors import OutputError, UsageError
from defshade_cli.image.colour import Pixels
from defshade_cli.image.compare import is_picture
from defshade_cli.image.cryptomatte import read_manifests
from defshade_cli.image.layers import ALIASES, AS_STORED, LAYERS, SCENE_LINEAR, Layer, in_order
from defshade_cli.image.metadata import read_provenance
from defshade_cli.image.ocio import find_render_space
from defshade_cli.image.reading import grouped, parts, uncropped
from defshade_cli.image.render_space import REC709, RenderSpace

DISPLAY_ENCODED = "display-encoded"
"""The unit of pictures, which are shown as they are."""

_UNKNOWN = Layer("", (), AS_STORED, AS_STORED, AS_STORED, 0.0, True, AS_STORED)


@dataclass(frozen=True, slots=True, eq=False)
class StoredImage:
    """A file's layers.

    layers: name → (H, W, C) float32, as `reading.read` has them; all of one size, in the table's order.
    rows: what each means: by the header, else by the table of layers, else guessed from its channels.
    manifests: of layers that hold ids: name → what each id stands for.
    facts: the provenance in the header.
    space: of light and reflectance.
    """

    path: Path
    layers: dict[str, Pixels]
    rows: dict[str, Layer]
    manifests: dict[str, dict[int, str]]
    facts: dict[str, Any]
    space: RenderSpace

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        height, width = next(iter(self.layers.values())).shape[:2]
        return width, height

    def named(self, names: Iterable[str]) -> tuple[str, ...]:
        """The file's own names of some layers, which other renderers' names stand for too.

        Raises UsageError for what the file lacks.
        """
        found = [name if name in self.layers else ALIASES.get(name, name) for name in names]
        if missing := [name for name in found if name not in self.layers]:
            raise UsageError(f"{self.path} has no layer {missing[0]}; it has {', '.join(self.layers)}")
        return tuple(dict.fromkeys(found))


def open_image(path: Path, config: str = "") -> StoredImage:
    """Read all of a file. config: the OCIO config's name. Raises OutputError."""
    layers: dict[str, Pixels] = {}
    channels: dict[str, tuple[str, ...]] = {}
    header: dict[str, Any] = {}
    for spec, pixels in parts(path):
        header = {entry.name: entry.value for entry in spec.extra_attribs} | header
        for name, indices in grouped(spec).items():
            if name not in layers:
                layers[name] = uncropped(spec, pixels)[..., indices]
                channels[name] = tuple(spec.channelnames[index].rpartition(".")[2] for index in indices)
    if len({pixels.shape[:2] for pixels in layers.values()}) > 1:
        raise OutputError(f"{path}: its parts are of different sizes")
    layers = {name: layers[name] for name in in_order(layers)}
    facts = read_provenance(header.items())
    meanings = json.loads(facts.get("layers", "{}"))
    rows = {name: _row(name, channels[name], meanings.get(name, {}), picture=is_picture(path)) for name in layers}
    return StoredImage(path, layers, rows, _manifests(header, facts, layers), facts, _space(header, config))


def _row(name: str, channels: tuple[str, ...], meaning: Mapping[str, Any], *, picture: bool) -> Layer:
    if picture:
        return replace(_UNKNOWN, name=name, channels=channels, unit=DISPLAY_ENCODED, summary="a picture")
    known = name if meaning else ALIASES.get(name.rpartition(".")[2], name)
    if known in LAYERS:
        return replace(LAYERS[known].of_width(len(channels)), name=name)
    unit = meaning.get("unit") or (SCENE_LINEAR if set("RGB") <= set(channels) else AS_STORED)
    alike = next((row for row in LAYERS.values() if row.unit == unit), _UNKNOWN)
    background, space = float(meaning.get("background", alike.background)), meaning.get("space", alike.space)
    return replace(alike, name=name, channels=channels, unit=unit, space=space, background=background, summary=unit)


def _manifests(header: Mapping[str, Any], facts: Mapping[str, Any], layers: Iterable[str]) -> dict[str, dict[int, str]]:
    mattes = {LAYERS[name].exr_name: name for name in layers if name in LAYERS}
    found = {mattes.get(name, name): names for name, names in read_manifests(header).items()}
    for name in layers:
        if text := facts.get(f"{name}/manifest"):
            found[name] = {int(number): path for number, path in json.loads(text).items()}
    return found


def _space(header: Mapping[str, Any], config: str) -> RenderSpace:
    """What the header names, where the config knows it as a linear space; linear Rec.709 else."""
    name = header.get("colorInteropID", header.get("oiio:ColorSpace"))
    try:
        return find_render_space(name, config)
    except UsageError:
        return replace(REC709, config=config)
