"""The output layers: one table from which --layers, the docs, `inspect` and the EXR metadata come."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Source = Literal["lighting", "base", "metallic", "normal", "roughness", "emission", "depth"]


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


def _color(name: str, source: Source, summary: str) -> Layer:
    return Layer(name, ("R", "G", "B"), "scene-linear", "render", source, 0.0, False, summary)


def _scalar(name: str, source: Source, summary: str) -> Layer:
    return Layer(name, ("Y",), "0..1", "none", source, 0.0, False, summary)


_RGBA, _XYZ = ("R", "G", "B", "A"), ("X", "Y", "Z")

LAYERS: dict[str, Layer] = {
    layer.name: layer
    for layer in (
        Layer("beauty", _RGBA, "scene-linear", "render", "lighting", 0.0, True, "the lit image, alpha premultiplied"),
        Layer("depth", ("Z",), "scene units", "camera", "depth", float("inf"), False, "planar: distance along the camera's axis"),
        Layer("distance", ("Z",), "scene units", "camera", "depth", float("inf"), False, "radial: distance from the camera's position"),
        Layer("position", _XYZ, "scene units", "world", "depth", 0.0, False, "the point that the pixel's centre sees"),
        Layer("normal", _XYZ, "unit vector", "world", "normal", 0.0, False, "shading normal, facing the camera"),
        _color("albedo", "base", "diffuse colour of the material before metallic darkens it"),
        _scalar("metallic", "metallic", "metalness"),
        _scalar("roughness", "roughness", "perceptual roughness; GGX alpha is its square"),
        _color("emission", "emission", "emitted radiance"),
    )
}  # fmt: skip
