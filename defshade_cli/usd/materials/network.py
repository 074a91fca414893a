"""The values that reach the inputs of shader nodes, through the interfaces of materials and node graphs."""

from __future__ import annotations

from typing import Any

from pxr import Usd, UsdShade

from defshade_cli.usd.color_space import in_rec709, is_color, unknown_space


class Network:
    """Reads shader nodes at one time. time_varying: some value that was read differs over time.

    unknown_spaces: names of colour spaces that nobody knows, as the keys of a dictionary.
    """

    def __init__(self, time: Usd.TimeCode) -> None:
        self.time = time
        self.time_varying = False
        self.unknown_spaces: dict[str, None] = {}

    def value(self, node: UsdShade.Shader, name: str, default: Any = None) -> Any:
        """The value of an input; `default` where none is authored or a node computes it."""
        attribute = self.source(node, name)
        value = None if attribute is None or computed(attribute) else self.of(attribute)
        return default if value is None else value

    def of(self, attribute: Usd.Attribute) -> Any:
        """The value of an attribute that holds one; a colour in linear Rec.709."""
        self.time_varying |= attribute.ValueMightBeTimeVarying()
        value = attribute.Get(self.time)
        if not is_color(attribute):
            return value
        self.note_space(attribute)
        return in_rec709(attribute, value)

    def note_space(self, attribute: Usd.Attribute) -> None:
        """Of a colour, or of a file of them."""
        if name := unknown_space(attribute):
            self.unknown_spaces[name] = None

    def source(self, node: UsdShade.Shader, name: str) -> Usd.Attribute | None:
        """The attribute that an input's value comes from: an input somewhere, or the output of another node."""
        found = node.GetInput(name)
        sources = found.GetValueProducingAttributes() if found else ()
        return sources[0] if sources else None


def computed(attribute: Usd.Attribute) -> bool:
    """Is it the output of a node?"""
    return bool(UsdShade.Output.IsOutput(attribute))


def node_of(output: Usd.Attribute) -> tuple[UsdShade.Shader, str]:
    """The node that computes an output, and what kind of node it is."""
    node = UsdShade.Shader(output.GetPrim())
    return node, str(node.GetShaderId() or "a node without id")
