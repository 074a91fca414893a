"""The nodes that give an image its texture coordinates, as one affine map of one primvar."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pxr import UsdShade

from defshade_cli.scene.texture import Affine
from defshade_cli.usd.materials.materialx.graph import Graph, Unread, category_of
from defshade_cli.usd.materials.network import computed, node_of

FIRST_SET = "st"
"""What OpenUSD calls the coordinates of `texcoord`; its further sets are st1, st2 and so on."""

_TRANSFORM_FIRST = 1
"""place2d's operationorder: offset, rotation, scale in place of scale, rotation, offset."""


class Coordinates(NamedTuple):
    """matrix · (u, v, 1) of a primvar; matrix: (3, 3) float64. No primvar for constant coordinates."""

    uv: str
    matrix: NDArray[np.float64]

    def moved(self, matrix: NDArray[np.float64]) -> Coordinates:
        """The coordinates after a further matrix (3, 3)."""
        return Coordinates(self.uv, matrix @ self.matrix)

    @property
    def affine(self) -> Affine:
        """The two rows of the matrix that count."""
        first, second = self.matrix[:2].tolist()
        return tuple(first), tuple(second)


def read_coordinates(graph: Graph, node: UsdShade.Shader, name: str = "texcoord") -> Coordinates:
    """What reaches an input of type vector2; the first set where nothing does. Raises Unread."""
    source = graph.network.source(node, name)
    if source is None:
        return Coordinates(FIRST_SET, np.eye(3))
    if not computed(source):
        return _constant(graph.values(node, name, (0, 0)))
    producer, identifier = node_of(source)
    read = _READERS.get(category := category_of(identifier, _READERS))
    if read is None:
        raise Unread(f"texture coordinates of {category}")
    with graph.step():
        return read(graph, producer)


def placed(graph: Graph, node: UsdShade.Shader) -> Coordinates:
    """place2d: an image that is moved, turned and scaled about a pivot."""
    pivot, offset = _pair(graph, node, "pivot", 0), _pair(graph, node, "offset", 0)
    order = int(graph.values(node, "operationorder", 0)[0])
    scale, rotate = _pair(graph, node, "scale", 1), float(graph.values(node, "rotate", 0)[0])
    return read_coordinates(graph, node).moved(_placing(pivot, _inverse(scale), rotate, -offset, order))


def gltf_placed(graph: Graph, node: UsdShade.Shader) -> Coordinates:
    """glTF's image nodes have their own place2d, which transforms coordinates as KHR_texture_transform does."""
    pivot, offset = _pair(graph, node, "pivot", (0, 1)), _pair(graph, node, "offset", 0)
    order = int(graph.values(node, "operationorder", 0)[0])
    scale, rotate = _pair(graph, node, "scale", 1), float(graph.values(node, "rotate", 0)[0])
    return read_coordinates(graph, node).moved(_placing(pivot, scale, -rotate, offset * (1, -1), order))


def tiled(graph: Graph, node: UsdShade.Shader) -> Coordinates:
    """tiledimage: (uv · uvtiling − uvoffset) / realworldimagesize · realworldtilesize."""
    size = _pair(graph, node, "realworldtilesize", 1) * _inverse(_pair(graph, node, "realworldimagesize", 1))
    shift = _shift(-_pair(graph, node, "uvoffset", 0))
    return read_coordinates(graph, node).moved(_scale(size) @ shift @ _scale(_pair(graph, node, "uvtiling", 1)))


def _placing(
    pivot: NDArray[np.float64], scale: NDArray[np.float64], rotate: float, shift: NDArray[np.float64], order: int
) -> NDArray[np.float64]:
    steps = [_scale(scale), _rotation(rotate), _shift(shift)]
    first, second, third = reversed(steps) if order == _TRANSFORM_FIRST else steps
    return _shift(pivot) @ third @ second @ first @ _shift(-pivot)


def _texcoord(graph: Graph, node: UsdShade.Shader) -> Coordinates:
    index = int(graph.values(node, "index", 0)[0])
    return Coordinates(f"{FIRST_SET}{index or ''}", np.eye(3))


def _named(attribute: str) -> Callable[[Graph, UsdShade.Shader], Coordinates]:
    """The primvar of a geompropvalue or a primvar reader; MaterialX's own name for the first set is UV0."""

    def read(graph: Graph, node: UsdShade.Shader) -> Coordinates:
        name = graph.text(node, attribute, FIRST_SET)
        return Coordinates(FIRST_SET if name == "UV0" else name, np.eye(3))

    return read


def _transform2d(graph: Graph, node: UsdShade.Shader) -> Coordinates:
    """in · scale · rotation + translation, as UsdTransform2d's schema says."""
    scale, shift = _pair(graph, node, "scale", 1), _pair(graph, node, "translation", 0)
    rotation = _rotation(-float(graph.values(node, "rotation", 0)[0]))
    return read_coordinates(graph, node, "in").moved(_shift(shift) @ rotation @ _scale(scale))


def _rotate2d(graph: Graph, node: UsdShade.Shader) -> Coordinates:
    return read_coordinates(graph, node, "in").moved(_rotation(float(graph.values(node, "amount", 0)[0])))


def _through(graph: Graph, node: UsdShade.Shader) -> Coordinates:
    return read_coordinates(graph, node, "in")


def _multiply(graph: Graph, node: UsdShade.Shader) -> Coordinates:
    return read_coordinates(graph, node, "in1").moved(_scale(_pair(graph, node, "in2", 1)))


def _divide(graph: Graph, node: UsdShade.Shader) -> Coordinates:
    return read_coordinates(graph, node, "in1").moved(_scale(_inverse(_pair(graph, node, "in2", 1))))


def _add(graph: Graph, node: UsdShade.Shader) -> Coordinates:
    return read_coordinates(graph, node, "in1").moved(_shift(_pair(graph, node, "in2", 0)))


def _subtract(graph: Graph, node: UsdShade.Shader) -> Coordinates:
    return read_coordinates(graph, node, "in1").moved(_shift(-_pair(graph, node, "in2", 0)))


_READERS: dict[str, Callable[[Graph, UsdShade.Shader], Coordinates]] = {
    "texcoord": _texcoord,
    "geompropvalue": _named("geomprop"),
    "UsdPrimvarReader": _named("varname"),
    "UsdTransform2d": _transform2d,
    "place2d": placed,
    "rotate2d": _rotate2d,
    "multiply": _multiply,
    "divide": _divide,
    "add": _add,
    "subtract": _subtract,
    "dot": _through,
    "convert": _through,
}


def _pair(graph: Graph, node: UsdShade.Shader, name: str, default: ArrayLike) -> NDArray[np.float64]:
    return np.broadcast_to(graph.values(node, name, default)[:2], 2)


def _constant(values: NDArray[np.float64]) -> Coordinates:
    u, v = np.broadcast_to(values[:2], 2)
    return Coordinates("", np.array([[0, 0, u], [0, 0, v], [0, 0, 1.0]]))


def _scale(factors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.diag([*factors, 1.0])


def _shift(offset: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[1, 0, offset[0]], [0, 1, offset[1]], [0, 0, 1.0]])


def _rotation(degrees: float) -> NDArray[np.float64]:
    """MaterialX's rotate2d: clockwise."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1.0]])


def _inverse(factors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(factors == 0, 1.0, 1.0 / np.where(factors == 0, 1.0, factors))
