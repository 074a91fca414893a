"""The nodes that can be computed: images, constants, channels, and arithmetic."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pxr import UsdShade

from defshade_cli.usd.materials.materialx import images
from defshade_cli.usd.materials.materialx.graph import Evaluate, Graph, Unread
from defshade_cli.usd.materials.materialx.signal import NonLinear, Signal, Values, by_values, constant, joined, mixed

_CHANNEL_NAMES = {"r": 0, "g": 1, "b": 2, "a": 3, "x": 0, "y": 1, "z": 2, "w": 3}
_NO_COLOR = (0.0, 0.0, 0.0)
_LUMA = (0.2722287, 0.6740818, 0.0536895)
"""The nodes' own default, luminance in ACEScg."""

_BLACK, _WHITE = constant(0.0), constant(1.0)


Default = float | tuple[float, ...]


def _arithmetic(function: Callable[..., Signal], **inputs: Default) -> Evaluate:
    """A node that is a function of its inputs, named with their defaults."""

    def evaluate(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
        operands = (graph.signal(node, name, default) for name, default in inputs.items())
        return function(*operands).widened(width)

    return evaluate


def _of_values(function: Callable[..., Values], **inputs: Default) -> Evaluate:
    """A node that is no linear function: computed for constants alone."""
    return _arithmetic(lambda *operands: by_values(function, *operands), **inputs)


def _constant(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
    return graph.signal(node, "value", 0.0).widened(width)


def _convert(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
    """To four channels, one becomes gray with an alpha of 1."""
    found = graph.signal(node, "in", 0.0)
    return found.widened(3).widened(4) if width == 4 and found.width == 1 else found.widened(width)


def _extract(graph: Graph, node: UsdShade.Shader, _: str, __: int) -> Signal:
    return graph.signal(node, "in", (0, 0, 0)).pick([int(graph.values(node, "index", 0)[0])])


def _separate(graph: Graph, node: UsdShade.Shader, output: str, _: int) -> Signal:
    """Its outputs are outr, outg and so on, or outx, outy."""
    return graph.signal(node, "in", (0, 0, 0)).pick([_CHANNEL_NAMES.get(output[-1:], 0)])


def _swizzle(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
    """Letters for channels, 0 and 1 for those constants."""
    found = graph.signal(node, "in", (0, 0, 0))
    constants = {"0": _BLACK, "1": _WHITE}
    channels = graph.text(node, "channels", "rgba"[:width])
    return joined([constants.get(c) or found.pick([_CHANNEL_NAMES.get(c, 0)]) for c in channels]).widened(width)


def _combine(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
    names = ("in1", "in2", "in3", "in4")
    parts = [graph.signal(node, name, 0.0) for name in names if graph.network.source(node, name)]
    missing = max(0, width - sum(part.width for part in parts))
    return joined([*parts, *[_BLACK] * missing]).widened(width)


def _clamp(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
    """Between 0 and 1, as by default, the fields of a material are clamped in any case."""
    found = graph.signal(node, "in", 0.0).widened(width)
    low, high = graph.signal(node, "low", 0.0), graph.signal(node, "high", 1.0)
    if found.is_constant:
        return by_values(lambda value, least, most: np.clip(value, least, most), found, low, high)
    if np.any(graph.values(node, "low", 0.0) > 0.0) or np.any(graph.values(node, "high", 1.0) < 1.0):
        raise NonLinear
    return found


def _normal_map(graph: Graph, node: UsdShade.Shader, _: str, __: int) -> Signal:
    """in · 2 − 1, its slope scaled."""
    slope = np.broadcast_to(graph.values(node, "scale", 1.0)[:2], 2)
    found = graph.signal(node, "in", (0.5, 0.5, 1.0)).widened(3)
    return (found * constant(2.0) - constant(1.0)) * constant([*slope, 1.0])


def _switch(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
    which = int(graph.values(node, "which", 0)[0])
    return graph.signal(node, f"in{which + 1}", 0.0).widened(width)


def _comparison(holds: Callable[[float, float], bool]) -> Evaluate:
    def evaluate(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
        first, second = graph.values(node, "value1", 1.0)[0], graph.values(node, "value2", 0.0)[0]
        return graph.signal(node, "in1" if holds(first, second) else "in2", 0.0).widened(width)

    return evaluate


def _primvar(name: str, fallback: str) -> Evaluate:
    """A primvar that is no texture coordinate: the node's own default, or nothing."""

    def evaluate(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
        reason = f"primvar {graph.text(node, name, '')}"
        if not graph.network.source(node, fallback):
            raise Unread(reason)
        graph.lost.append(reason)
        return graph.signal(node, fallback, 0.0).widened(width)

    return evaluate


def _remap(value: Signal, in_low: Signal, in_high: Signal, out_low: Signal, out_high: Signal) -> Signal:
    return out_low + (value - in_low) / (in_high - in_low) * (out_high - out_low)


def _range(graph: Graph, node: UsdShade.Shader, _: str, width: int) -> Signal:
    if np.any(graph.values(node, "gamma", 1.0) != 1.0):
        raise NonLinear
    names = {"inlow": 0.0, "inhigh": 1.0, "outlow": 0.0, "outhigh": 1.0}
    return _remap(graph.signal(node, "in", 0.0), *(graph.signal(node, n, d) for n, d in names.items())).widened(width)


def _of_color(function: Callable[[Values], Values]) -> Evaluate:
    """The same of a colour, for which a single number may stand."""
    return _arithmetic(lambda color: by_values(function, color.widened(3)), **{"in": _NO_COLOR})


def _luminance(value: Values, coefficients: Values) -> Values:
    return np.full_like(value, np.dot(value[:3], coefficients[:3]))


def _saturated(value: Values, amount: Values, coefficients: Values) -> Values:
    gray = _luminance(value, coefficients)
    return gray + (value - gray) * amount


def _smooth(value: Values, low: Values, high: Values) -> Values:
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def _from_hsv(value: Values) -> Values:
    """The six ramps of hue between which saturation and value draw."""
    hue, saturation, brightness = value[:3]
    ramps = np.clip(np.abs((6.0 * hue + np.array([0.0, 4.0, 2.0])) % 6.0 - 3.0) - 1.0, 0.0, 1.0)
    return brightness * (1.0 + saturation * (ramps - 1.0))


def _to_hsv(value: Values) -> Values:
    most, spread = value[:3].max(), np.ptp(value[:3])
    if spread == 0.0:
        return np.array([0.0, 0.0, most])
    largest = int(value[:3].argmax())
    hue = (2.0 * largest + (value[(largest + 1) % 3] - value[(largest + 2) % 3]) / spread) / 6.0
    return np.array([hue % 1.0, spread / most, most])


def _blended(operation: Callable[[Signal, Signal], Signal]) -> Evaluate:
    """A compositing node: as much of the operation, over the background, as `mix` says."""
    return _arithmetic(lambda bg, fg, amount: mixed(bg, operation(bg, fg), amount), bg=0.0, fg=0.0, mix=1.0)


NODES: dict[str, Evaluate] = {
    "image": images.image,
    "tiledimage": images.tiled_image,
    "gltf_image": images.gltf_image,
    "gltf_colorimage": images.gltf_color_image,
    "gltf_normalmap": images.gltf_normal_map,
    "UsdUVTexture": images.uv_texture,
    "geompropvalue": _primvar("geomprop", "default"),
    "UsdPrimvarReader": _primvar("varname", "fallback"),
    "constant": _constant,
    "convert": _convert,
    "extract": _extract,
    "swizzle": _swizzle,
    "normalmap": _normal_map,
    "normal_map_decode": _normal_map,
    "clamp": _clamp,
    "switch": _switch,
    "range": _range,
    **{f"separate{count}": _separate for count in (2, 3, 4)},
    **{f"combine{count}": _combine for count in (2, 3, 4)},
    "ifgreater": _comparison(lambda a, b: a > b),
    "ifgreatereq": _comparison(lambda a, b: a >= b),
    "ifequal": _comparison(lambda a, b: a == b),
    "add": _arithmetic(lambda a, b: a + b, in1=0.0, in2=0.0),
    "subtract": _arithmetic(lambda a, b: a - b, in1=0.0, in2=0.0),
    "multiply": _arithmetic(lambda a, b: a * b, in1=0.0, in2=1.0),
    "divide": _arithmetic(lambda a, b: a / b, in1=0.0, in2=1.0),
    "invert": _arithmetic(lambda amount, value: amount - value, amount=1.0, **{"in": 0.0}),
    "mix": _arithmetic(mixed, bg=0.0, fg=0.0, mix=0.0),
    "dot": _arithmetic(lambda value: value, **{"in": 0.0}),
    "remap": _arithmetic(_remap, **{"in": 0.0}, inlow=0.0, inhigh=1.0, outlow=0.0, outhigh=1.0),
    "contrast": _arithmetic(
        lambda value, by, pivot: (value - pivot) * by + pivot, **{"in": 0.0}, amount=1.0, pivot=0.5
    ),
    "plus": _blended(lambda bg, fg: bg + fg),
    "minus": _blended(lambda bg, fg: bg - fg),
    "screen": _blended(lambda bg, fg: bg + fg - bg * fg),
    "luminance": _of_values(_luminance, **{"in": 0.0}, lumacoeffs=_LUMA),
    "saturate": _of_values(_saturated, **{"in": 0.0}, amount=1.0, lumacoeffs=_LUMA),
    "smoothstep": _of_values(_smooth, **{"in": 0.0}, low=0.0, high=1.0),
    "hsvtorgb": _of_color(_from_hsv),
    "rgbtohsv": _of_color(_to_hsv),
    "floor": _of_values(np.floor, **{"in": 0.0}),
    "ceil": _of_values(np.ceil, **{"in": 0.0}),
    "round": _of_values(np.round, **{"in": 0.0}),
    "sign": _of_values(np.sign, **{"in": 0.0}),
    "ln": _of_values(np.log, **{"in": 1.0}),
    "tan": _of_values(np.tan, **{"in": 0.0}),
    "power": _of_values(np.power, in1=0.0, in2=1.0),
    "min": _of_values(np.minimum, in1=0.0, in2=0.0),
    "max": _of_values(np.maximum, in1=0.0, in2=0.0),
    "modulo": _of_values(np.mod, in1=0.0, in2=1.0),
    "absval": _of_values(np.abs, **{"in": 0.0}),
    "sqrt": _of_values(np.sqrt, **{"in": 0.0}),
    "exp": _of_values(np.exp, **{"in": 0.0}),
    "sin": _of_values(np.sin, **{"in": 0.0}),
    "cos": _of_values(np.cos, **{"in": 0.0}),
}
