"""The output layers: one table from which --layers, the docs, `inspect` and the EXR metadata come."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf
from typing import Literal

Source = Literal["lighting", "base", "metallic", "normal", "roughness", "emission", "depth"]

BEAUTY = "beauty"
MAIN_PART = "rgba"
"""The part of a multi-part EXR that holds the beauty, as Nuke names it."""

SCENE_LINEAR, SCENE_UNITS, UNIT_VECTOR = "scene-linear", "scene units", "unit vector"


@dataclass(frozen=True, slots=True)
class Layer:
    """One output layer.

    channels: EXR channel suffixes.  unit, space: as written to the metadata.
    source: where the passes find it: the lighting, or a plane of the float GBuffer.
    background: the value of a pixel that nothing covers.
    filtered: averaged over samples; data layers are one sample at the pixel's centre, because an averaged
        depth makes flying points and an averaged normal shrinks.
    """

    name: str
    channels: tuple[str, ...]
    unit: str
    space: str
    source: Source
    background: float
    filtered: bool
    summary: str

    @property
    def is_color(self) -> bool:
        """Light or reflectance that a display transform can show; the rest is data, kept in 32 bits."""
        return self.unit == SCENE_LINEAR

    @property
    def channel_names(self) -> tuple[str, ...]:
        """As in EXR: `R` for the beauty, which readers look for without a layer, `normal.X` for the others."""
        return self.channels if self.name == BEAUTY else tuple(f"{self.name}.{c}" for c in self.channels)


def _color(name: str, source: Source, summary: str) -> Layer:
    return Layer(name, ("R", "G", "B"), SCENE_LINEAR, "render", source, 0.0, False, summary)


def _scalar(name: str, source: Source, summary: str) -> Layer:
    return Layer(name, ("Y",), "0..1", "none", source, 0.0, False, summary)


def _range(name: str, summary: str) -> Layer:
    return Layer(name, ("Z",), SCENE_UNITS, "camera", "depth", inf, False, summary)


def _sampling(name: str, unit: str, summary: str) -> Layer:
    return Layer(name, ("Y",), unit, "none", "lighting", 0.0, True, summary)


_RGBA, _XYZ = ("R", "G", "B", "A"), ("X", "Y", "Z")

LAYERS: dict[str, Layer] = {
    layer.name: layer
    for layer in (
        Layer(BEAUTY, _RGBA, SCENE_LINEAR, "render", "lighting", 0.0, True, "the lit image, alpha premultiplied"),
        _range("depth", "planar: distance along the camera's axis"),
        _range("distance", "radial: distance from the camera's position"),
        Layer("position", _XYZ, SCENE_UNITS, "world", "depth", 0.0, False, "the point that the pixel's centre sees"),
        Layer("normal", _XYZ, UNIT_VECTOR, "world", "normal", 0.0, False, "shading normal, facing the camera"),
        _color("albedo", "base", "diffuse colour of the material before metallic darkens it"),
        _scalar("metallic", "metallic", "metalness"),
        _scalar("roughness", "roughness", "perceptual roughness; GGX alpha is its square"),
        _color("emission", "emission", "emitted radiance"),
        _sampling("variance", "scene-linear²", "variance of the beauty's luminance, as a mean of samples"),
        _sampling("sampleCount", "samples", "samples of the beauty"),
    )
}  # fmt: skip


def in_order(names: Iterable[str]) -> tuple[str, ...]:
    """`names` as the table orders them, so that files do not depend on the order of a request."""
    return tuple(sorted(names, key=list(LAYERS).index))
