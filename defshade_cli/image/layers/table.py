"""The table of output layers."""

from __future__ import annotations

from dataclasses import replace
from math import inf

from defshade_cli.image.layers.layer import BEAUTY, ID, MATTE_CHANNELS, SCENE_LINEAR, SCENE_UNITS, UNIT_VECTOR, Layer
from defshade_cli.settings import RenderSettings

_RGBA, _XYZ = ("R", "G", "B", "A"), ("X", "Y", "Z")

DEFAULT_RANKS = RenderSettings().cryptomatte_levels


def _color(name: str, source: str, summary: str) -> Layer:
    return Layer(name, ("R", "G", "B"), SCENE_LINEAR, "render", source, 0.0, False, summary)


def _light(name: str, summary: str) -> Layer:
    return Layer(name, ("R", "G", "B"), SCENE_LINEAR, "render", "lighting", 0.0, True, summary)


def _scalar(name: str, source: str, summary: str, first: int = 0, background: float = 0.0) -> Layer:
    return Layer(name, ("Y",), "0..1", "none", source, background, False, summary, first)


def _range(name: str, summary: str) -> Layer:
    return Layer(name, ("Z",), SCENE_UNITS, "camera", "depth", inf, False, summary)


def _point(name: str, space: str, summary: str) -> Layer:
    return Layer(name, _XYZ, SCENE_UNITS, space, "depth", 0.0, False, summary)


def _direction(name: str, space: str, source: str, summary: str) -> Layer:
    return Layer(name, _XYZ, UNIT_VECTOR, space, source, 0.0, False, summary)


def _motion(name: str, whither: str, first: int) -> Layer:
    summary = f"what is seen here, {whither}"
    return Layer(name, ("U", "V"), "pixels a frame", "raster, y up", "motion", 0.0, False, summary, first)


def _statistic(name: str, unit: str, summary: str) -> Layer:
    return Layer(name, ("Y",), unit, "none", "lighting", 0.0, True, summary)


def _id(name: str, source: str, summary: str) -> Layer:
    return Layer(name, ("ID",), ID, "none", source, -1.0, False, summary)


def _matte(name: str, summary: str) -> Layer:
    """Ranks in pairs, two to a group of four channels; as many as --cryptomatte-levels says."""
    return Layer(name, MATTE_CHANNELS[: 2 * DEFAULT_RANKS], "id and coverage", "none", "matte", 0.0, True, summary)


ROWS: dict[str, Layer] = {
    layer.name: layer
    for layer in (
        Layer(BEAUTY, _RGBA, SCENE_LINEAR, "render", "lighting", 0.0, True, "the lit image, alpha premultiplied"),
        Layer("alpha", ("A",), "0..1", "none", "coverage", 0.0, True, "the beauty's coverage by itself"),
        _light("diffuse", "light from diffuse lobes"),
        _light("specular", "light from specular lobes and clearcoats"),
        Layer("shadow", ("Y",), "0..1", "none", "lighting", 1.0, True, "share of the lights' irradiance that arrives"),
        Layer(
            "lightComplexity", ("Y",), "volumes", "none", "lighting", 0.0, True, "light volumes that touch the pixel"
        ),
        _range("depth", "planar: distance along the camera's axis"),
        _range("distance", "radial: distance from the camera's position"),
        _point("position", "world", "the point that the pixel's centre sees"),
        _point("Peye", "camera", "the same point: +X right, +Y up, −Z ahead"),
        _direction("normal", "world", "normal", "shading normal, facing the camera"),
        _direction("Neye", "camera", "normal", "shading normal in camera space"),
        _direction("geometricNormal", "world", "facet", "normal of the triangle, facing the camera"),
        _direction("tangent", "world", "tangent", "where u grows, across the shading normal; 0 without uv"),
        Layer("uv", ("U", "V"), "texture coordinates", "none", "uv", 0.0, False, "primvar st, else the first there is"),
        _statistic("variance", "scene-linear²", "variance of the beauty's luminance, as a mean of samples"),
        _statistic("sampleCount", "samples", "samples of the beauty"),
        _color("albedo", "base", "diffuse colour of the material before metallic darkens it"),
        _scalar("metallic", "base", "metalness", first=3),
        _scalar("roughness", "normal", "perceptual roughness; GGX alpha is its square", first=3),
        _color("specularF0", "specular", "reflectance at normal incidence"),
        _color("emission", "emission", "emitted radiance"),
        _scalar("clearcoat", "clearcoat", "amount of clearcoat"),
        _scalar("clearcoatRoughness", "clearcoat", "perceptual roughness of the clearcoat", first=1),
        _scalar("occlusion", "occlusion", "the material's occlusion; direct light does not see it", background=1.0),
        _motion("motionForward", "to where it is a frame later", 2),
        _motion("motionBackward", "to where it was a frame before", 0),
        _id("primId", "visible", "the prim: the manifest has its path"),
        _id("instanceId", "visible", "which instance of the prim; −1 for what is none"),
        _id("elementId", "visible", "the face of the mesh as authored"),
        _id("materialId", "visible", "the material: the manifest has its path"),
        _id("semantic", "visible", "what the prim is: the manifest has its labels"),
        _matte("cryptoObject", "Cryptomatte of prims"),
        _matte("cryptoMaterial", "Cryptomatte of materials"),
        _matte("cryptoAsset", "Cryptomatte of components, as model kinds have them"),
    )
}

LIGHT_FAMILY, PRIMVAR_FAMILY = "light:", "primvars:"
DEFAULT_GROUP = f"{LIGHT_FAMILY}default"

FAMILIES: dict[str, Layer] = {
    PRIMVAR_FAMILY: Layer(
        f"{PRIMVAR_FAMILY}NAME", (*_XYZ, "W"), "as authored", "as authored", "primvar", 0.0, False, "a primvar"
    ),
    LIGHT_FAMILY: _light(f"{LIGHT_FAMILY}GROUP", "light of a group: by name, light's name or path; * matches any"),
}
"""Rows for any number of layers, by how their names begin."""


def family_row(name: str) -> Layer | None:
    """The row of a layer such as `light:key`; None for what is of no family."""
    for prefix, row in FAMILIES.items():
        if name.startswith(prefix) and len(name) > len(prefix):
            return replace(row, name=name)
    return None
