"""A MaterialX surface shader's inputs, and the material that is made of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any, cast

import numpy as np
from pxr import UsdShade

from defshade_cli.dataclass import dataclass
from defshade_cli.scene.material import TEXTURED_FIELDS
from defshade_cli.scene.texture import Channel, Four, TextureInput
from defshade_cli.usd.materials.materialx.graph import Graph, Unread
from defshade_cli.usd.materials.materialx.nodes import NODES
from defshade_cli.usd.materials.materialx.signal import NonLinear, Signal, constant
from defshade_cli.usd.materials.network import Network, computed, node_of
from defshade_cli.usd.polygons.primvars import DISPLAY_COLOR
from defshade_cli.usd.values import is_numbers

_LETTERS = "rgba"


@dataclass(frozen=True, slots=True)
class Model:
    """One shading model.

    defaults: every input that is read, with the nodedef's value.
    left_out: inputs of which ours knows nothing → (the value without effect, the input that they belong to or "");
        they are lost where they are authored, differ from that value, and what they belong to is not 0.
    translate: fills a Translation.
    """

    defaults: Mapping[str, Any]
    left_out: Mapping[str, tuple[Any, str]]
    translate: Callable[[Translation], None]


@dataclass(slots=True)
class Translation:
    """From one shader's inputs to the fields of a Material. Nothing raises: what cannot be said is lost, and named.

    occlusion: is it to be read?
    values: constants by field.  textures, primvars: what replaces them.  lost: inputs of the shader, with reasons.
    """

    shader: UsdShade.Shader
    network: Network
    model: Model
    occlusion: bool
    values: dict[str, Any] = field(default_factory=dict)
    textures: dict[str, TextureInput] = field(default_factory=dict)
    primvars: dict[str, str] = field(default_factory=dict)
    lost: dict[str, None] = field(default_factory=dict)

    def run(self) -> Translation:
        """Translate the surface, and note which inputs that matter were left out."""
        self.model.translate(self)
        for name, (neutral, owner) in self.model.left_out.items():
            if self._differs(name, neutral) and (not owner or self._differs(owner, 0.0)):
                self.lose(name)
        return self

    def lose(self, name: str, *reasons: str) -> None:
        """Note an input that is lost, and why."""
        self.lost[f"{name} ({', '.join(dict.fromkeys(reasons))})" if reasons else name] = None

    def authored(self, name: str) -> bool:
        """Whether the input has a value or a connection."""
        return self.network.source(self.shader, name) is not None

    def __getitem__(self, name: str) -> Signal:
        """What reaches an input; the nodedef's value where it is not authored, or cannot be read."""
        default = self.model.defaults[name]
        graph = Graph(self.network, NODES)
        try:
            return graph.signal(self.shader, name, default)
        except Unread as reason:
            graph.lost.append(str(reason))
            return constant(default)
        finally:
            if graph.lost:
                self.lose(name, *graph.lost)

    def put(self, target: str, signal: Signal, name: str) -> None:
        """Fill a field; `name` is the input that is lost where no texture input can say it."""
        color = target == "normal" or target.endswith("_color")
        signal = signal.widened(3) if color else signal
        if signal.is_constant:
            self.values[target] = tuple(signal.bias.tolist()) if color else float(signal.bias.mean())
            return
        if target not in TEXTURED_FIELDS:
            self.lose(name, "an image")
            return
        try:
            self.textures[target] = _texture_input(signal if color else self._single(signal, name))
        except NonLinear:
            self.lose(name, "its channels come in another order")

    def put_product(self, target: str, *names: str) -> None:
        """The product of inputs; of several images the last counts."""
        *weights, last = (self[name] for name in names)
        for weight, name in zip(reversed(weights), reversed(names[:-1]), strict=True):
            try:
                last = last * weight
            except NonLinear:
                self.lose(name, "an image times an image")
        self.put(target, last, names[-1])

    def put_base(self, name: str, weight: str) -> None:
        """diffuse_color; a primvar where the network reads nothing else."""
        varname, fallback = self._primvar(name)
        if varname:
            self.values["uses_display_color"] = True
            self.values["color_primvar"] = "" if varname == DISPLAY_COLOR else varname
            if fallback is not None:
                self.put("diffuse_color", constant(fallback), name)
            return
        self.put_product("diffuse_color", weight, name) if weight else self.put("diffuse_color", self[name], name)

    def put_plain(self, target: str, name: str) -> None:
        """A field that is an input as it is; a primvar too where the network reads nothing else."""
        varname, fallback = self._primvar(name)
        if not varname:
            self.put(target, self[name], name)
            return
        self.primvars[target] = varname
        self.put(target, constant(self.model.defaults[name] if fallback is None else fallback), name)

    def _primvar(self, name: str) -> tuple[str, Any]:
        """The primvar that an input is, and what stands in for it; an empty name for anything else."""
        source = self.network.source(self.shader, name)
        if source is None or not computed(source):
            return "", None
        node, identifier = node_of(source)
        read_as = ("varname", "fallback") if "UsdPrimvarReader" in identifier else ("geomprop", "default")
        varname, fallback = (self.network.value(node, attribute) for attribute in read_as)
        return str(varname or ""), fallback if is_numbers(fallback) else None

    def put_occlusion(self, name: str = "occlusion") -> None:
        """Put the occlusion that was found beside the surface, if any."""
        if self.occlusion:
            self.put("occlusion", self[name], name)

    def put_normal(self, name: str) -> None:
        """A normal in tangent space; a constant one that leans has no counterpart."""
        source = self.network.source(self.shader, name)
        if source is None or not computed(source):
            return
        normal = self[name].widened(3)
        if not normal.is_constant:
            self.put("normal", normal, name)
        elif not np.allclose(normal.bias, (0, 0, 1)):
            self.lose(name)

    def put_specular(self, weight: str, tint: str, ior: str, metalness: str) -> None:
        """The dielectric's reflection, F0 = weight · tint · ((ior − 1) / (ior + 1))².

        By an ior of that F0 where it is gray, by the specular workflow where there is no metal to it.
        """
        index, metal = self[ior], self[metalness]
        ratio = (index.bias.mean() - 1.0) / (index.bias.mean() + 1.0)
        if not index.is_constant:
            self.put("ior", index, ior)
            return
        try:
            f0 = self[weight] * self[tint] * constant(ratio**2)
        except NonLinear:
            self.lose(weight, "an image times an image")
            f0 = self[tint] * constant(ratio**2)
        if f0.is_constant and np.ptp(f0.bias) == 0.0:
            self.values["ior"] = _ior(float(np.clip(f0.bias[0], 0.0, 0.99)))
        elif metal.is_constant and not metal.bias.any():
            self.values["use_specular_workflow"] = True
            self.put("specular_color", f0, tint)
        else:
            self.values["ior"] = float(index.bias.mean())
            self.lose(tint if self[weight].is_constant else weight, "together with metal")

    def put_transparency(self, opacity: str | None, transmission: str) -> None:
        """Opacity is presence. Transmission lets light through unbent, as UsdPreviewSurface's transparency does."""
        self.values["opacity_mode"] = "presence"
        transmitted, present = self[transmission], self[opacity] if opacity else constant(1.0)
        if opacity:
            self.put("opacity", present, opacity)
        if transmitted.is_constant and not transmitted.bias.any():
            return
        if present.is_constant and (present.bias == 1.0).all():
            self.values["opacity_mode"] = "transparent"
            self.put("opacity", constant(1.0) - transmitted, transmission)
            self.lose(transmission, "drawn thin, without refraction")
        else:
            self.lose(transmission)

    def _single(self, signal: Signal, name: str) -> Signal:
        """One channel of it: the first, where they differ."""
        channels = zip(signal.sources, signal.scale, signal.bias, strict=True)
        if len(set(channels)) > 1:
            self.lose(name, "the first channel counts")
        return signal.pick([0])

    def _differs(self, name: str, neutral: Any) -> bool:
        """Is an input authored with an effect? An image always counts as having one."""
        source = self.network.source(self.shader, name)
        if source is None:
            return name in self.model.defaults and bool(np.any(np.asarray(self.model.defaults[name]) != neutral))
        if computed(source):
            return True
        value = self.network.of(source)
        return value is not None and not np.allclose(np.asarray(value, np.float64), neutral)


def _ior(f0: float) -> float:
    root = float(np.sqrt(f0))
    return (1.0 + root) / (1.0 - root)


def _texture_input(signal: Signal) -> TextureInput:
    """Raises NonLinear for channels in an order of their own."""
    assert signal.lookup is not None
    sources = {source for source, scale in zip(signal.sources, signal.scale, strict=True) if scale}
    if len(sources) == 1:
        channel = _LETTERS[sources.pop()]
    elif signal.sources == (0, 1, 2):
        channel = "rgb"
    else:
        raise NonLinear
    texture, uv, affine = signal.lookup
    scale, bias = (cast(Four, tuple(values.tolist())) for values in (_four(signal.scale), _four(signal.bias)))
    return TextureInput(texture, cast(Channel, channel), scale, bias, uv, affine)


def _four(values: np.ndarray) -> np.ndarray:
    """Four channels of one, or of three."""
    return np.broadcast_to(values, 4) if len(values) == 1 else np.append(values[:3], 1.0)
