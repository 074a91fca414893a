"""UsdShade materials as scene.Material.

Read are UsdPreviewSurface nodes whose inputs are constant or come from a UsdUVTexture or a primvar, also through the
interfaces of materials and node graphs; usd/materials/worn.py asks the prims for their primvars. Any other source of an
input is named in the report, and so is a texture without its file: the input then takes the fallback that is authored
on the node in its place, or the schema's default. MaterialX shaders are translated by usd/materialx; a material that
has both is a UsdPreviewSurface, of which nothing is lost.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from pxr import Sdf, Usd, UsdShade

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.material import TEXTURED_FIELDS, UNBOUND, UV_SETS, Material
from defshade_cli.scene.scene import Unsupported
from defshade_cli.scene.texture import TextureInput
from defshade_cli.usd.materials.fields import FIELDS
from defshade_cli.usd.materials.network import Network, computed, node_of
from defshade_cli.usd.materials.texture import Unreadable, read_texture_input
from defshade_cli.usd.polygons.primvars import DISPLAY_COLOR
from defshade_cli.usd.values import is_finite

if TYPE_CHECKING:
    from defshade_cli.usd.materials.materialx.surface import Translation

_NEUTRAL: dict[str, Any] = {"displacement": 0.0, "normal": (0.0, 0.0, 1.0)}
"""Constants that change nothing, of inputs of which no other constant is drawn."""

_WITHOUT_EFFECT = ("occlusion",)
"""Inputs that direct light does not see: occlusion dims what comes from all around. Only a layer shows it."""

_SHARES = ("metallic", "roughness", "clearcoat", "clearcoat_roughness", "opacity")
"""Fields from 0 to 1. Roughness beyond is that of no surface, and its lobe's normalization overflows."""

_DEFAULTS = {f.name: f.default for f in fields(Material)}
_CHANNELS = {"r": slice(0, 1), "g": slice(1, 2), "b": slice(2, 3), "a": slice(3, 4)}
_READER = "UsdPrimvarReader_"
_DISPLAY_OPACITY = "displayOpacity"
_PREVIEW_SURFACE = "UsdPreviewSurface"
_MATERIALX = "mtlx"


@dataclass(frozen=True, slots=True)
class ReadMaterial:
    """understood: its surface is of a model that we know.  time_varying: some value that was read differs over time."""

    material: Material
    understood: bool = True
    time_varying: bool = False
    issues: tuple[Unsupported, ...] = ()


@dataclass(slots=True)
class _Inputs:
    """What reading a node's inputs gathers."""

    network: Network
    values: dict[str, Any] = field(default_factory=dict)
    textures: dict[str, TextureInput] = field(default_factory=dict)
    primvars: dict[str, str] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)


def read_material(
    stage: Usd.Stage, path: Sdf.Path, shown_as: str, time: Usd.TimeCode, *, occlusion: bool = False
) -> ReadMaterial:
    """The material at `path`, reported as `shown_as`; one that is not understood is drawn like an unbound one.

    occlusion: read it too.
    """
    prim = UsdShade.Material(stage.GetPrimAtPath(path))
    if not prim:
        return not_understood(shown_as, "the bound material does not exist")
    network = Network(time)
    shader, identifier = _surface_of(prim)
    read: _Inputs | Translation
    if identifier == _PREVIEW_SURFACE:
        read = inputs = _read_inputs(shader, network, () if occlusion else _WITHOUT_EFFECT)
        reason, left_out = "without", inputs.left_out
    elif _is_understood(identifier):
        from defshade_cli.usd.materials.materialx.models import translate

        read = translation = translate(shader, identifier, network, occlusion=occlusion)
        reason, left_out = f"lost of {identifier}:", list(translation.lost)
    else:
        return not_understood(shown_as, _surface_named(prim, shader, identifier))
    left_out.extend(f"colour space {name}" for name in network.unknown_spaces)
    values = sound(read.values, left_out)
    material = Material(shown_as, **values, primvars=read.primvars, inputs=read.textures)
    left_out.extend(f"textures at primvar {name}" for name in material.uv_names[UV_SETS:])
    issues = (Unsupported(shown_as, f"{reason} {', '.join(left_out)}"),) if left_out else ()
    return ReadMaterial(material, time_varying=network.time_varying, issues=issues)


def _surface_of(material: UsdShade.Material) -> tuple[UsdShade.Shader, str]:
    """The surface's shader and what it is: the universal one, else MaterialX's."""
    sources = [material.ComputeSurfaceSource(c)[0] for c in (UsdShade.Tokens.universalRenderContext, _MATERIALX)]
    for shader in filter(None, sources):
        identifier = str(shader.GetShaderId() or "")
        if _is_understood(identifier):
            return shader, identifier
    shader = next((found for found in sources if found and found.GetShaderId()), sources[0])
    return shader, str(shader.GetShaderId() or "") if shader else ""


def _is_understood(identifier: str) -> bool:
    """MaterialX is imported where something else than a UsdPreviewSurface is met."""
    if identifier in ("", _PREVIEW_SURFACE):
        return bool(identifier)
    from defshade_cli.usd.materials.materialx.models import MODELS

    return identifier in MODELS


def not_understood(path: str, reason: str) -> ReadMaterial:
    """A material that is drawn like an unbound one."""
    material = replace(UNBOUND, path=path)
    return ReadMaterial(material, understood=False, issues=(Unsupported(path, reason),))


def _surface_named(material: UsdShade.Material, shader: UsdShade.Shader, identifier: str) -> str:
    if shader:
        return f"surface {identifier or 'shader of source code'} is not UsdPreviewSurface"
    contexts = [output.GetBaseName() for output in material.GetSurfaceOutputs() if output.HasConnectedSource()]
    return f"no UsdPreviewSurface, only {', '.join(contexts)}" if contexts else "no surface"


def _read_inputs(shader: UsdShade.Shader, network: Network, skipped: tuple[str, ...]) -> _Inputs:
    inputs = _Inputs(network)
    for authored in shader.GetInputs():
        name = authored.GetBaseName()
        if name in skipped:
            continue
        source = network.source(shader, name)
        if source is None:
            if _is_adrift(authored.GetAttr()):
                inputs.left_out.append(f"{name} (connected to nothing)")
            continue
        if computed(source):
            _take_from_node(inputs, name, source)
        elif name in _NEUTRAL:
            if network.of(source) not in (None, _NEUTRAL[name]):
                inputs.left_out.append(f"{name} (the same everywhere)")
        else:
            _take(inputs, name, network.of(source))
    return inputs


def _is_adrift(attribute: Usd.Attribute) -> bool:
    """Is it connected to what the stage lacks?"""
    stage, targets = attribute.GetStage(), attribute.GetConnections()
    return bool(targets) and not any(stage.GetPropertyAtPath(target) for target in targets)


def _take(inputs: _Inputs, name: str, value: Any) -> None:
    if FIELDS.get(name) not in _DEFAULTS or value is None:
        return
    try:
        inputs.values[FIELDS[name]] = as_field(value, _DEFAULTS[FIELDS[name]])
    except (TypeError, ValueError):
        inputs.left_out.append(f"{name} ({type(value).__name__})")


def _take_from_node(inputs: _Inputs, name: str, output: Usd.Attribute) -> None:
    """A value that a node computes: a texture or a primvar; where it has none, and of all other nodes, the fallback."""
    node, identifier = node_of(output)
    varname = inputs.network.value(node, "varname") if identifier.startswith(_READER) else None
    if varname and (name == "diffuseColor" or (name == "opacity" and varname == _DISPLAY_OPACITY)):
        _take_from_display(inputs, name, node, str(varname))
        return
    _take(inputs, name, _fallback(inputs.network, node, output.GetBaseName()))
    if identifier == "UsdUVTexture" and FIELDS.get(name) in TEXTURED_FIELDS:
        try:
            inputs.textures[FIELDS[name]] = read_texture_input(inputs.network, output)
        except Unreadable as reason:
            inputs.left_out.append(f"{name} ({reason})")
    elif varname and isinstance(_DEFAULTS.get(FIELDS.get(name, "")), float | tuple):
        inputs.primvars[FIELDS[name]] = str(varname)
    else:
        inputs.left_out.append(f"{name} (primvar {varname})" if varname else f"{name} ({identifier})")


def _take_from_display(inputs: _Inputs, name: str, node: UsdShade.Shader, varname: str) -> None:
    """What may vary over a prim: any primvar for the colour, for the opacity displayOpacity."""
    _take(inputs, name, _fallback(inputs.network, node, "result"))
    if name == "diffuseColor":
        inputs.values["uses_display_color"] = True
        inputs.values["color_primvar"] = "" if varname == DISPLAY_COLOR else varname
    else:
        inputs.values["uses_display_opacity"] = True


def sound(values: Mapping[str, Any], left_out: list[str]) -> dict[str, Any]:
    """The values that light can be reckoned with; the others are named, and the schema's defaults take their place."""
    odd = [name for name, value in values.items() if not is_finite(value)]
    left_out.extend(f"{name} (not finite)" for name in odd)
    if values.get("ior", 0.0) < 0.0:
        left_out.append("ior (below 0)")
        odd.append("ior")
    sound = {name: value for name, value in values.items() if name not in odd}
    for name in (name for name in _SHARES if name in sound):
        value, sound[name] = sound[name], min(max(sound[name], 0.0), 1.0)
        if value != sound[name]:
            left_out.append(f"{name} ({value:g} counts as {sound[name]:g})")
    return sound


def _fallback(network: Network, node: UsdShade.Shader, channel: str) -> Any:
    """The fallback authored on a texture or primvar reader, as the channel that is connected; else None."""
    value = network.value(node, "fallback")
    return value if value is None or channel not in _CHANNELS else np.asarray(value)[_CHANNELS[channel]]


def as_field(value: Any, default: Any) -> Any:
    """`value` as the type of the field's default; a scalar fills a colour, a colour beyond three channels is cut.

    Raises TypeError or ValueError for what is of no such type.
    """
    if isinstance(default, tuple):
        channels = np.ravel(np.asarray(value, np.float64))
        return tuple(np.broadcast_to(channels[:3], 3).tolist())
    if isinstance(default, float):
        return float(np.ravel(value)[0])
    return type(default)(value)
