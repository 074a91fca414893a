"""A MaterialX network of UsdShade nodes, followed from an output back to what it is made of."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import field
from typing import Any

import numpy as np
from pxr import Usd, UsdShade

from defshade_cli.dataclass import dataclass
from defshade_cli.usd.materials.materialx.signal import NonLinear, Signal, Values, constant
from defshade_cli.usd.materials.network import Network, computed, node_of

_DEEPEST = 64
"""Nodes in a row; a network of more is taken for one that runs in a circle."""

_WIDTHS = {"float": 1, "half": 1, "double": 1, "int": 1, "bool": 1}
_SHOWN_THROUGH = ("in", "in1", "in2", "fg", "bg")
"""Inputs of which one stands in for a node that cannot be computed."""


class Unread(Exception):
    """Part of a network that nothing can stand in for; its text says what in a few words."""


Evaluate = Callable[["Graph", UsdShade.Shader, str, int], Signal]
"""(graph, node, name of the output, its channels) → what comes out."""


@dataclass(slots=True)
class Graph:
    """evaluators: by category, `multiply` of `ND_multiply_color3FA`.  lost: what was passed over, in order."""

    network: Network
    evaluators: Mapping[str, Evaluate]
    lost: list[str] = field(default_factory=list)
    _depth: int = 0

    def signal(self, node: UsdShade.Shader, name: str, default: Any) -> Signal:
        """What reaches an input. Raises Unread."""
        source = self.network.source(node, name)
        if source is not None and computed(source):
            return self.output(source)
        value = None if source is None else self.network.of(source)
        return constant(default if value is None else _numbers(value))

    def values(self, node: UsdShade.Shader, name: str, default: Any) -> Values:
        """What reaches an input that has to be constant. Raises Unread where it is not."""
        signal = self.signal(node, name, default)
        if not signal.is_constant:
            raise Unread(f"{name} from an image")
        return signal.bias

    def text(self, node: UsdShade.Shader, name: str, default: str) -> str:
        """The value of an input that is a string."""
        return str(self.network.value(node, name, default))

    def output(self, output: Usd.Attribute) -> Signal:
        """What a node computes; where no scale and bias can say it, what enters the node. Raises Unread."""
        node, identifier = node_of(output)
        name, width = output.GetName().rpartition(":")[2], _width(output)
        evaluate = self.evaluators.get(category := category_of(identifier, self.evaluators))
        with self.step():
            try:
                return evaluate(self, node, name, width) if evaluate else self._past(node, category, width)
            except NonLinear:
                return self._past(node, category, width)

    @contextmanager
    def step(self) -> Iterator[None]:
        """One node further. Raises Unread where there have been too many."""
        if self._depth >= _DEEPEST:
            raise Unread("a network that runs in a circle")
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1

    def _past(self, node: UsdShade.Shader, category: str, width: int) -> Signal:
        """The first image that enters a node, or else its first value."""
        found = [self.signal(node, name, 0.0) for name in _SHOWN_THROUGH if self.network.source(node, name)]
        if not found:
            raise Unread(category)
        self.lost.append(category)
        return next((signal for signal in found if not signal.is_constant), found[0]).widened(width)


def category_of(identifier: str, known: Mapping[str, Any]) -> str:
    """The longest known category that `ND_<category>_<types>` starts with, else all up to the last underscore."""
    name = identifier.removeprefix("ND_")
    parts = name.split("_")
    starts = ("_".join(parts[:count]) for count in range(len(parts), 0, -1))
    return next((start for start in starts if start in known), "_".join(parts[:-1]) or name)


def _numbers(value: Any) -> Values:
    try:
        return np.ravel(np.asarray(value, np.float64))
    except (TypeError, ValueError):
        raise Unread(f"a value of type {type(value).__name__}") from None


def _width(output: Usd.Attribute) -> int:
    """Channels of an output; those of no numeric type count as colours."""
    type_name = str(output.GetTypeName())
    digits = [int(character) for character in type_name if character in "234"]
    return _WIDTHS.get(type_name, digits[0] if digits else 3)
